// Where the platform will be in the next frame: constant velocity.
#pragma once

#include "host/tracker/rotation.h"

namespace tagwrench {

/// Less motion than this between frames (m, rad) is the noise of edges: the platform stands still.
/// At 3 um and 0.3 mrad their noise kept the picture from being learned. Where more matters, as
/// while the picture is averaged, one looks closer.
inline bool stands_still(const Vector6& motion) {
  return motion.head<3>().norm() < 15e-6 && motion.tail<3>().norm() < 1e-3;
}

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
