// Rotations and poses of the simulator, its own so that no error here can cancel one in the
// tracker.
#pragma once

#include <Eigen/Core>
#include <cmath>

namespace tagwrench::sim {

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

}  // namespace tagwrench::sim
