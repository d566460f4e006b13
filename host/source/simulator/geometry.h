// The lens: pinhole with OpenCV's five-coefficient distortion, and the ray that every pixel looks
// along.
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <vector>

#include "host/source/simulator/scenario.h"

namespace tagwrench::sim {

// Rotations and poses of the simulator, its own so that no error here can cancel one in the
// tracker.

/// Rodrigues' formula: the rotation by |r| about r.
inline Eigen::Matrix3d rotation_matrix(const Eigen::Vector3d& r) {
  const double angle = r.norm();
  Eigen::Matrix3d cross;
  cross << 0, -r.z(), r.y(), r.z(), 0, -r.x(), -r.y(), r.x(), 0;
  const double a = angle < 1e-6 ? 1.0 : std::sin(angle) / angle;
  const double half_sine = angle < 1e-6 ? 0.5 * angle : std::sin(0.5 * angle);
  const double b = angle < 1e-6 ? 0.5 : 2.0 * half_sine * half_sine / (angle * angle);
  return Eigen::Matrix3d::Identity() + a * cross + b * cross * cross;
}

struct RigidPose {
  Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();
  Eigen::Vector3d position = Eigen::Vector3d::Zero();

  RigidPose operator*(const RigidPose& inner) const {
    return {rotation * inner.rotation, rotation * inner.position + position};
  }
  Eigen::Vector3d operator*(const Eigen::Vector3d& point) const {
    return rotation * point + position;
  }
};

/// Where the ray (x/z, y/z) lands in the image, px.
Eigen::Vector2d project(const Camera& camera, const Eigen::Vector2d& ray) noexcept;

/// The ray (x/z, y/z) that lands on a pixel: Newton's method on project(). False if it does not
/// converge, that is, if the distortion folds the image over.
bool unproject(const Camera& camera, const Eigen::Vector2d& pixel, Eigen::Vector2d& ray) noexcept;

/// One ray per pixel, and one more pixel on each side so that rays between pixels follow from
/// neighbours.
class RayTable {
 public:
  /// Throws ConfigError if the distortion cannot be inverted all over the image.
  explicit RayTable(const Camera& camera);

  const float* x(int row) const noexcept { return x_.data() + offset(row); }
  const float* y(int row) const noexcept { return y_.data() + offset(row); }

 private:
  std::size_t offset(int row) const noexcept {
    return static_cast<std::size_t>(row + 1) * static_cast<std::size_t>(stride_) + 1;
  }

  int stride_;
  std::vector<float> x_, y_;
};

// Where the tags really sit after somebody has glued them on.

struct PlacedTag {
  int id = 0;
  RigidPose platform_T_tag;
};

/// Nominal placement plus seeded errors, shifted so that the midpoint of the tag centres is the
/// platform's origin.
std::vector<PlacedTag> placed_tags(const Scenario& scenario);

/// camera_T_platform at a displacement from rest: R_now = exp(r), since the platform's axes are the
/// camera's at rest.
RigidPose platform_pose(const Target& target,
                        const Eigen::Matrix<double, 6, 1>& displacement) noexcept;

}  // namespace tagwrench::sim
