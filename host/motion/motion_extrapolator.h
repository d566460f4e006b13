// Motion between two frames of a slow camera.
#pragma once

#include <array>
#include <cstdint>

#include "host/core/types.h"

namespace tagwrench {

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
