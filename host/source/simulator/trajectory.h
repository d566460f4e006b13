// What the user does to the platform, as a function of time.
#pragma once

#include <Eigen/Core>
#include <array>

#include "host/source/simulator/scenario.h"
#include "host/types.h"

namespace tagwrench::sim {

class TrajectoryPlayer {
 public:
  TrajectoryPlayer(const Trajectory& trajectory, std::uint64_t seed);

  /// What the user applies at `time` seconds after the start: N and N m about the platform origin
  /// at rest, camera axes.
  Vector6 applied_wrench(double time) const noexcept;

  /// Acceleration of the base and everything on it (m/s^2), beyond standing still; only a drop has
  /// any.
  Eigen::Vector3d base_acceleration(double time) const noexcept;

 private:
  static constexpr int kTones = 5;
  struct Tone {
    double frequency, phase, weight;
  };

  Vector6 steps(double time) const noexcept;
  Vector6 sweep(double time) const noexcept;
  Vector6 tap(double time) const noexcept;
  Vector6 compound(double time) const noexcept;
  Vector6 on_axis(double value) const noexcept;

  Trajectory trajectory_;
  std::array<std::array<Tone, kTones>, 6> tones_{};
};

}  // namespace tagwrench::sim
