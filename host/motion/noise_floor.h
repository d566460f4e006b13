// How much the wrench scatters while nobody pushes.
#pragma once

#include <array>

#include "host/core/types.h"

namespace tagwrench {

/// The larger of two: what the samples say of their own noise, and how they really scatter from
/// frame to frame (second differences, which a slow drift does not touch). Learnt at rest alone,
/// so that a hand's tremor numbs nothing, and a push has the same newtons from its first frame to
/// its last.
///
/// Why eight standard deviations of it are a dead zone: an hour at 60 frames a second on six axes
/// is 1.3 million numbers. Normal noise leaves six once in 390 hours. That of rendered JPEG
/// pictures has longer tails: of 89,850 numbers 40 lay beyond four and two beyond five, where
/// normal noise has 6 and 0.05. If each sigma more is 20 times rarer, eight are left once in 280
/// hours, without a filter and without a dead zone of the user's.
class NoiseFloor {
 public:
  /// `seconds` after the last frame, 0 for the first. `rest`: nobody pushes, as far as is known.
  void add(double seconds, const Vector6& value, const Vector6& sigma, bool rest) noexcept;

  /// One standard deviation; zero before the first frame.
  const Vector6& sigma() const noexcept { return sigma_; }

 private:
  void learn_scatter(double seconds, double weight, const Vector6& value) noexcept;

  int known_ = 0;     ///< of the last two values: those in a row, at rest
  bool any_ = false;  ///< frame, ever
  double last_step_ = 0;
  std::array<Vector6, 2> values_ = {Vector6::Zero(), Vector6::Zero()};  ///< last, and before it
  Vector6 stated_ = Vector6::Zero();                                    ///< variance
  Vector6 scatter_ = Vector6::Zero();                                   ///< variance
  Vector6 sigma_ = Vector6::Zero();
};

}  // namespace tagwrench
