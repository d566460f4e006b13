// Rotations as vectors, small motions of a pose, and where constant velocity takes it next.
#pragma once

#include <Eigen/Geometry>
#include <cmath>
#include <vector>

#include "host/core/types.h"

namespace tagwrench {

inline Eigen::Matrix3d cross_matrix(const Eigen::Vector3d& v) {
  Eigen::Matrix3d m;
  m << 0, -v.z(), v.y(), v.z(), 0, -v.x(), -v.y(), v.x(), 0;
  return m;
}

/// exp: rotation vector (rad) to rotation matrix.
inline Eigen::Matrix3d rotation_from_vector(const Eigen::Vector3d& r) {
  const double angle = r.norm();
  if (angle < 1e-12) return Eigen::Matrix3d::Identity() + cross_matrix(r);
  return Eigen::AngleAxisd(angle, r / angle).toRotationMatrix();
}

/// log: rotation matrix to rotation vector (rad), angle in [0, pi].
inline Eigen::Vector3d rotation_to_vector(const Eigen::Matrix3d& rotation) {
  Eigen::Quaterniond q(rotation);
  if (q.w() < 0) q.coeffs() = -q.coeffs();
  const double s = q.vec().norm();
  if (s < 1e-12) return 2.0 * q.vec();
  return q.vec() * (2.0 * std::atan2(s, q.w()) / s);
}

/// The pose after a small motion seen along camera axes: translation of the body's origin (m), then
/// a rotation vector (rad) about that origin.
inline Eigen::Isometry3d moved(const Eigen::Isometry3d& camera_T_body, const Vector6& motion) {
  Eigen::Isometry3d out = camera_T_body;
  out.translation() += motion.head<3>();
  out.linear() = rotation_from_vector(motion.tail<3>()) * camera_T_body.linear();
  return out;
}

/// The motion that takes `from` to `to`: moved(from, motion_between(from, to)) == to. This is the
/// displacement that types.h defines when `from` is the reference pose.
inline Vector6 motion_between(const Eigen::Isometry3d& from, const Eigen::Isometry3d& to) {
  Vector6 motion;
  motion.head<3>() = to.translation() - from.translation();
  motion.tail<3>() = rotation_to_vector(to.linear() * from.linear().transpose());
  return motion;
}

/// The platform frame where nothing else is said: its origin at the midpoint of the tags' centres,
/// its axes along the camera's.
inline Eigen::Isometry3d midpoint_frame(const std::vector<Eigen::Isometry3d>& camera_T_tag) {
  Eigen::Isometry3d camera_T_platform = Eigen::Isometry3d::Identity();
  for (const Eigen::Isometry3d& pose : camera_T_tag)
    camera_T_platform.translation() +=
        pose.translation() / static_cast<double>(camera_T_tag.size());
  return camera_T_platform;
}

/// Whether a motion with this covariance (m and rad) is known well enough to make a force of it.
/// The limits are chosen, far above what a held target has: edges leave 1.6 um and 0.2 mrad in
/// simulated frames, photometric alignment a fifth of it. They stop fits that hardly determine an
/// axis.
inline bool is_precise(const Matrix6& covariance) {
  constexpr double kMaxTranslation = 0.3e-3;
  constexpr double kMaxRotation = 0.03;
  const Vector6 sigma = covariance.diagonal().cwiseMax(0.0).cwiseSqrt();
  return sigma.head<3>().maxCoeff() < kMaxTranslation && sigma.tail<3>().maxCoeff() < kMaxRotation;
}

/// Removes the rounding that products of rotations pile up.
inline void renormalise(Eigen::Isometry3d& pose) {
  pose.linear() = Eigen::Quaterniond(pose.linear()).normalized().toRotationMatrix();
}

/// Less motion than this between frames (m, rad) is the noise of edges: the platform stands still.
/// At 3 um and 0.3 mrad their noise kept the picture from being learned. Where more matters, as
/// while the picture is averaged, one looks closer.
inline bool stands_still(const Vector6& motion) {
  return motion.head<3>().norm() < 15e-6 && motion.tail<3>().norm() < 1e-3;
}

/// Where the platform will be in the next frame.
class ConstantVelocityPredictor {
 public:
  /// Forgets the velocity.
  void start(TimePoint time, const Eigen::Isometry3d& camera_T_platform) {
    last_ = camera_T_platform;
    time_ = time;
    step_.setZero();
    period_ = Duration::zero();
  }

  void add(TimePoint time, const Eigen::Isometry3d& camera_T_platform) {
    step_ = motion_between(last_, camera_T_platform);
    period_ = time - time_;
    last_ = camera_T_platform;
    time_ = time;
  }

  /// A gap longer than a few frames, or clocks that stand still, tell nothing about where the
  /// platform has gone.
  Eigen::Isometry3d predict(TimePoint time) const {
    constexpr double kMaxGap = 3.5;  // periods
    const Duration gap = time - time_;
    if (period_ <= Duration::zero() || gap <= Duration::zero()) return last_;
    const double part = static_cast<double>(gap.count()) / static_cast<double>(period_.count());
    return part < kMaxGap ? moved(last_, part * step_) : last_;
  }

  const Eigen::Isometry3d& last() const { return last_; }
  /// Between the last two frames.
  const Vector6& step() const { return step_; }
  Duration period() const { return period_; }

  /// Motion per second when the platform is at `pose` at `time`: the mean since the last frame, and
  /// what it has gained over the frames before. Zero when there is nothing to go by.
  Vector6 velocity(TimePoint time, const Eigen::Isometry3d& pose) const {
    const Duration gap = time - time_;
    if (period_ <= Duration::zero() || gap <= Duration::zero()) return Vector6::Zero();
    const auto seconds = [](Duration d) { return std::chrono::duration<double>(d).count(); };
    const Vector6 now = motion_between(last_, pose) / seconds(gap);
    return 1.5 * now - 0.5 * step_ / seconds(period_);
  }

 private:
  Eigen::Isometry3d last_ = Eigen::Isometry3d::Identity();
  TimePoint time_{};
  Vector6 step_ = Vector6::Zero();
  Duration period_{};
};

}  // namespace tagwrench
