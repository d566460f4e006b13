// The camera as calibration describes it, pinhole with OpenCV's five-coefficient distortion: camera
// coordinates to pixels, with the derivative, and back.
#pragma once

#include <Eigen/Core>
#include <Eigen/LU>
#include <array>
#include <cmath>
#include <optional>

namespace tagwrench {

struct CameraModel {
  int width_px = 640;
  int height_px = 480;
  double fx_px = 805.0;
  double fy_px = 805.0;
  double cx_px = 319.5;
  double cy_px = 239.5;
  std::array<double, 5> distortion{};  ///< k1 k2 p1 p2 k3
  /// The image is flipped left to right, as many camera modules deliver it. All other parameters
  /// describe the image after it has been flipped back.
  bool mirrored = false;
  /// Of a rolling shutter, from the first row to the last, s. 0: all rows are exposed at once.
  double readout = 0;
};

/// Nearer points are not projected, m.
constexpr double kNearest = 1e-4;

struct ProjectedPoint {
  Eigen::Vector2d pixel = Eigen::Vector2d::Zero();  ///< px, in the image after flipping back
  /// d pixel / d p_camera, px/m
  Eigen::Matrix<double, 2, 3> jacobian = Eigen::Matrix<double, 2, 3>::Zero();
  bool valid = false;  ///< false behind or at the lens
};

/// Pinhole with the radial (k1 k2 k3) and tangential (p1 p2) model of OpenCV's calib3d:
/// x'' = x' (1 + k1 r^2 + k2 r^4 + k3 r^6) + 2 p1 x' y' + p2 (r^2 + 2 x'^2), y'' alike.
inline ProjectedPoint project(const CameraModel& camera, const Eigen::Vector3d& p_camera) {
  ProjectedPoint out;
  if (!(p_camera.z() > kNearest)) return out;
  const double iz = 1.0 / p_camera.z();
  const double x = p_camera.x() * iz;
  const double y = p_camera.y() * iz;
  const auto& [k1, k2, p1, p2, k3] = camera.distortion;
  const double xx = x * x;
  const double yy = y * y;
  const double xy = x * y;
  const double r2 = xx + yy;
  const double radial = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3));
  const double slope = k1 + r2 * (2.0 * k2 + r2 * 3.0 * k3);  // d radial / d r2
  out.pixel.x() = camera.fx_px * (x * radial + 2.0 * p1 * xy + p2 * (r2 + 2.0 * xx)) + camera.cx_px;
  out.pixel.y() = camera.fy_px * (y * radial + p1 * (r2 + 2.0 * yy) + 2.0 * p2 * xy) + camera.cy_px;
  const double dxx = camera.fx_px * (radial + 2.0 * xx * slope + 2.0 * p1 * y + 6.0 * p2 * x);
  const double dxy = camera.fx_px * (2.0 * xy * slope + 2.0 * p1 * x + 2.0 * p2 * y);
  const double dyx = camera.fy_px * (2.0 * xy * slope + 2.0 * p1 * x + 2.0 * p2 * y);
  const double dyy = camera.fy_px * (radial + 2.0 * yy * slope + 6.0 * p1 * y + 2.0 * p2 * x);
  out.jacobian << dxx * iz, dxy * iz, -(dxx * x + dxy * y) * iz,  //
      dyx * iz, dyy * iz, -(dyx * x + dyy * y) * iz;
  out.valid = true;
  return out;
}

/// The point at z = 1 that projects to `pixel`: Newton's method from the undistorted guess. Empty
/// where the distortion polynomial cannot be inverted (far outside of the image).
inline std::optional<Eigen::Vector3d> unproject(const CameraModel& camera,
                                                const Eigen::Vector2d& pixel) {
  constexpr int kSteps = 20;
  constexpr double kClose_px = 1e-9;
  Eigen::Vector3d ray((pixel.x() - camera.cx_px) / camera.fx_px,
                      (pixel.y() - camera.cy_px) / camera.fy_px, 1.0);
  for (int i = 0; i < kSteps; ++i) {
    const ProjectedPoint at = project(camera, ray);
    const Eigen::Vector2d miss = pixel - at.pixel;
    if (!miss.allFinite()) break;
    if (miss.norm() < kClose_px) return ray;
    const Eigen::Matrix2d jacobian = at.jacobian.leftCols<2>();
    if (!(std::abs(jacobian.determinant()) > 0)) break;
    ray.head<2>() += jacobian.inverse() * miss;
  }
  return std::nullopt;
}

}  // namespace tagwrench
