#include "host/source/simulator/geometry.h"

#include <Eigen/LU>
#include <string>

#include "host/core/config_error.h"
#include "host/source/simulator/random.h"

namespace tagwrench::sim {
namespace {

constexpr int kMaxIterations = 30;
constexpr double kConverged = 1e-12;

// Distorted ray and its derivative by the undistorted one (OpenCV documentation, camera calibration
// and 3D reconstruction: x'' = x' (1 + k1 r^2 + k2 r^4 + k3 r^6) + 2 p1 x'y' + p2 (r^2 + 2 x'^2)).
Eigen::Vector2d distort(const std::array<double, 5>& k, const Eigen::Vector2d& ray,
                        Eigen::Matrix2d* derivative) {
  const double x = ray.x();
  const double y = ray.y();
  const double r2 = x * x + y * y;
  const double radial = 1 + r2 * (k[0] + r2 * (k[1] + r2 * k[4]));
  const double slope = k[0] + r2 * (2 * k[1] + r2 * 3 * k[4]);  // of radial by r^2
  if (derivative != nullptr) {
    const double cross = 2 * x * y * slope + 2 * k[2] * x + 2 * k[3] * y;
    *derivative << radial + 2 * x * x * slope + 2 * k[2] * y + 6 * k[3] * x, cross, cross,
        radial + 2 * y * y * slope + 6 * k[2] * y + 2 * k[3] * x;
  }
  return {x * radial + 2 * k[2] * x * y + k[3] * (r2 + 2 * x * x),
          y * radial + k[2] * (r2 + 2 * y * y) + 2 * k[3] * x * y};
}

}  // namespace

Eigen::Vector2d project(const Camera& camera, const Eigen::Vector2d& ray) noexcept {
  const Eigen::Vector2d bent = distort(camera.distortion, ray, nullptr);
  return {camera.fx_px * bent.x() + camera.cx_px, camera.fy_px * bent.y() + camera.cy_px};
}

bool unproject(const Camera& camera, const Eigen::Vector2d& pixel, Eigen::Vector2d& ray) noexcept {
  const Eigen::Vector2d wanted((pixel.x() - camera.cx_px) / camera.fx_px,
                               (pixel.y() - camera.cy_px) / camera.fy_px);
  ray = wanted;
  for (int i = 0; i < kMaxIterations; ++i) {
    Eigen::Matrix2d derivative;
    const Eigen::Vector2d error = distort(camera.distortion, ray, &derivative) - wanted;
    // A lens whose image turns back on itself has no ray here.
    if (!(derivative.determinant() > 0.05)) return false;
    if (error.norm() < kConverged) return true;
    ray -= derivative.inverse() * error;
  }
  return false;
}

RayTable::RayTable(const Camera& camera) : stride_(camera.width_px + 2) {
  const std::size_t size =
      static_cast<std::size_t>(stride_) * static_cast<std::size_t>(camera.height_px + 2);
  x_.resize(size);
  y_.resize(size);
  std::size_t i = 0;
  for (int row = -1; row <= camera.height_px; ++row) {
    for (int column = -1; column <= camera.width_px; ++column, ++i) {
      Eigen::Vector2d ray;
      if (!unproject(camera, {column, row}, ray)) {
        throw ConfigError("scenario: camera.distortion folds the image over near pixel (" +
                          std::to_string(column) + ", " + std::to_string(row) +
                          "): use smaller coefficients");
      }
      x_[i] = static_cast<float>(ray.x());
      y_[i] = static_cast<float>(ray.y());
    }
  }
}

std::vector<PlacedTag> placed_tags(const Scenario& scenario) {
  const Target& target = scenario.target;
  Random random(scenario.seed, kPlacement);
  const auto error = [&random](double largest) {
    const double x = random.uniform(-largest, largest);
    const double y = random.uniform(-largest, largest);
    return Eigen::Vector3d(x, y, random.uniform(-largest, largest));
  };
  std::vector<PlacedTag> tags;
  Eigen::Vector3d midpoint = Eigen::Vector3d::Zero();
  for (const TagPlacement& nominal : target.tags) {
    PlacedTag tag{nominal.id, {}};
    tag.platform_T_tag.position = nominal.position + error(target.position_error);
    tag.platform_T_tag.rotation =
        rotation_matrix(error(target.rotation_error)) * rotation_matrix(nominal.rotation);
    midpoint += tag.platform_T_tag.position / static_cast<double>(target.tags.size());
    tags.push_back(tag);
  }
  for (PlacedTag& tag : tags) tag.platform_T_tag.position -= midpoint;
  return tags;
}

RigidPose platform_pose(const Target& target,
                        const Eigen::Matrix<double, 6, 1>& displacement) noexcept {
  return {rotation_matrix(displacement.tail<3>()), target.rest_position + displacement.head<3>()};
}

}  // namespace tagwrench::sim
