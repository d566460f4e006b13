// The reference instruments at the simulated bench, each with its own rate, lag, noise and steps.
#pragma once

#include <array>
#include <cstdint>

#include "host/source/simulator/bench.h"
#include "host/source/simulator/random.h"

namespace tagwrench::sim {

struct SimulatedReading {
  double time = 0;                ///< s of simulation time, as the instrument stamps it
  std::array<double, 6> value{};  ///< N; of six axes N and N m about its own origin, camera axes
  std::array<double, 6> sigma{};  ///< one standard deviation of the noise, steps included
  std::uint8_t axes = 0;          ///< 1 or 6
  bool saturated = false;
};

/// Ticks of an instrument's own clock, and what is wrong with it.
class ReferenceTicks {
 public:
  ReferenceTicks(double rate, double first, const ReferenceFaults& faults) noexcept;
  double time() const noexcept { return time_; }  ///< of the next reading, s, true
  double stamp() const noexcept;                  ///< what it says
  bool silent() const noexcept;
  void advance() noexcept { time_ = first_ + static_cast<double>(++count_) * period_; }

 private:
  double period_, first_, time_;
  std::uint64_t count_ = 0;
  ReferenceFaults faults_;
};

/// Feels the force with which it is pressed against the platform.
class SimulatedLoadCell {
 public:
  /// Borrows the bench.
  explicit SimulatedLoadCell(const Bench& bench);

  /// Takes the next reading up to the bench's newest instant; false if there is none.
  bool next(SimulatedReading& reading) noexcept;

 private:
  const Bench& bench_;
  LoadCellSettings settings_;
  ReferenceTicks ticks_;
  Random random_;
  double scale_ = 1;
};

/// Sits under the sensor, its axes along the camera's, and feels what is applied to the platform:
/// F, and M - origin x F. It was zeroed with the sensor on it. The platform's inertia (F = m a,
/// less than 1 mN at hand speeds) and what the sensor's weight does after a turn are left out.
class SimulatedSixAxis {
 public:
  /// Borrows the bench.
  explicit SimulatedSixAxis(const Bench& bench);

  /// As above; what nobody took within the bench's memory is lost.
  bool next(SimulatedReading& reading) noexcept;

 private:
  void filter_to(double time) noexcept;

  const Bench& bench_;
  SixAxisSettings settings_;
  ReferenceTicks ticks_;
  Random random_;
  double delay_;            ///< s before the filter
  Eigen::Vector3d origin_;  ///< where it really is
  Eigen::Matrix3d reference_R_platform_ = Eigen::Matrix3d::Identity();
  double filtered_to_ = 0;  ///< s, true time of the load that the filter has taken
  Vector6 filtered_ = Vector6::Zero();
};

}  // namespace tagwrench::sim
