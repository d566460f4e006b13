// Motion between two frames of a slow camera.
#pragma once

#include <array>
#include <cstdint>

#include "host/core/types.h"

namespace tagwrench {

// The platform swings on its springs when a hand lets go at once: that is no push.

/// Knows a release by its suddenness: what was pushed within the last 60 ms or so is gone from one
/// frame to the next, or turned round. Nothing smaller than that push is one then, in any
/// direction, for a time that shrinks as the swing does. A hand that turns round by itself is slow
/// beside that and soon beyond it.
class RingdownSuppressor {
 public:
  /// `decay`: s, in which a swing falls to 1/e; 0: nothing is taken for one.
  explicit RingdownSuppressor(double decay) noexcept : decay_(decay) {}

  void reset() noexcept;
  /// `push` in full scales, `seconds` after the last one.
  void add(double seconds, const Vector6& push) noexcept;
  /// In full scales: what may be swing, on any axis.
  double size() const noexcept { return size_; }

 private:
  double decay_;
  double size_ = 0;
  Vector6 push_ = Vector6::Zero();  ///< the strongest of late
};

enum class Fill : std::uint8_t {
  none,     ///< the newest frame's motion stays until the next
  predict,  ///< it goes on as it went, for one and a half frame periods at most
};

/// Carries motion on from the newest frame, along what the last four agree on. No axis leaves rest,
/// crosses zero, leaves its limit or goes on by more than 0.3 of where it is; and a push that
/// slackens is taken to slacken faster still, so that its end is not overshot. Figures are in
/// tests/unit/motion/motion_fill_test.cpp.
class MotionExtrapolator {
 public:
  void reset() noexcept { *this = {}; }
  /// Times grow.
  void add(TimePoint time, const Vector6& motion) noexcept;

  const Vector6& newest() const noexcept { return motion_; }
  /// `limit`: the largest magnitude, per axis.
  Vector6 at(TimePoint time, const Vector6& limit) const noexcept;

 private:
  TimePoint time_{};
  Vector6 motion_ = Vector6::Zero();
  std::array<Vector6, 3> slopes_ = {Vector6::Zero(), Vector6::Zero(), Vector6::Zero()};
  std::array<double, 3> intervals_{};  ///< s; of these and of slopes_, the newest is the first
  int frames_ = 0;                     ///< seen, up to four
};

}  // namespace tagwrench
