// The simulated person at the desk, read without pictures: an hour in seconds.
#pragma once

#include <array>
#include <cstdint>

#include "host/core/types.h"
#include "host/source/simulator/random.h"
#include "host/source/simulator/scenario.h"
#include "host/source/simulator/trajectory.h"

namespace tagwrench::test {

struct DeskReadingOptions {
  double fps = 60;
  double exposure = 4e-3;           ///< s; a frame shows the mean of it
  Vector6 noise = Vector6::Zero();  ///< one standard deviation, N and N m
  double lost_share = 0;            ///< of frames
  double doubtful_share = 0;        ///< of frames
};

/// The platform as a sum of its modes, each stepped exactly for a load that is constant during a
/// millisecond; beside it the creep of the scenario's springs and the wander of their rest. What it
/// reads is stiffness times displacement, and noise.
class DeskReadings {
 public:
  DeskReadings(const sim::Scenario& scenario, const DeskReadingOptions& options);

  /// The next frame that is not lost: time, status, wrench and wrench_sigma.
  Sample next();

  const sim::DeskUse& use() const noexcept { return use_; }

 private:
  static constexpr double kStep = 1e-3;  // s

  void step();
  Vector6 load(double time);

  DeskReadingOptions options_;
  sim::Mechanics mechanics_;
  sim::DeskUse use_;
  sim::Random random_;
  Matrix6 stiffness_;
  Matrix6 modes_;                                   ///< columns; mass-normalised
  std::array<std::array<double, 6>, 6> advance_{};  ///< of each mode: 2x2 state, 2 load
  Vector6 position_ = Vector6::Zero();              ///< along the modes
  Vector6 speed_ = Vector6::Zero();
  Vector6 crept_ = Vector6::Zero();
  Vector6 displacement_ = Vector6::Zero();
  std::int64_t steps_ = 0;
  std::uint64_t frame_ = 0;
};

}  // namespace tagwrench::test
