#include "host/sensor/lens_check.h"

#include "host/tracker/projection.h"

namespace tagwrench {

std::optional<Eigen::Vector2d> fold(const CameraModel& camera) {
  constexpr int kSides = 16;  // places along each side of the image
  constexpr int kSteps = 32;  // from the centre to each
  constexpr int kWithin = 4;  // places in each step
  constexpr int kNewton = 10;
  constexpr double kClose_px = 1e-6;
  const Eigen::Vector2d centre(camera.cx_px, camera.cy_px);
  const auto folded = [&](const Eigen::Vector2d& ray) {
    return !(project(camera, ray.homogeneous()).jacobian.leftCols<2>().determinant() > 0);
  };
  const auto fold_toward = [&](const Eigen::Vector2d& border) -> std::optional<Eigen::Vector2d> {
    Eigen::Vector2d ray(0, 0);
    for (int step = 1; step <= kSteps; ++step) {
      const Eigen::Vector2d pixel = centre + (border - centre) * step / kSteps;
      const Eigen::Vector2d before = ray;
      double miss = 0;
      for (int i = 0; i < kNewton; ++i) {
        const ProjectedPoint at = project(camera, ray.homogeneous());
        miss = (pixel - at.pixel).norm();
        ray += at.jacobian.leftCols<2>().inverse() * (pixel - at.pixel);
      }
      if (!(miss < kClose_px)) return pixel;
      for (int i = 1; i <= kWithin; ++i) {
        if (folded(before + (ray - before) * i / kWithin)) return pixel;
      }
    }
    return std::nullopt;
  };
  const double right = camera.width_px - 1;
  const double bottom = camera.height_px - 1;
  for (int i = 0; i <= kSides; ++i) {
    const double part = static_cast<double>(i) / kSides;
    for (const Eigen::Vector2d& border :
         {Eigen::Vector2d(part * right, 0), Eigen::Vector2d(part * right, bottom),
          Eigen::Vector2d(0, part * bottom), Eigen::Vector2d(right, part * bottom)}) {
      if (const auto found = fold_toward(border)) return found;
    }
  }
  return std::nullopt;
}

}  // namespace tagwrench
