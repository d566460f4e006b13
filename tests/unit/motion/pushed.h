// Samples of pushes, for tests of what they move.
#pragma once

#include <cmath>

#include "host/motion/shaping.h"

namespace tagwrench {

/// `value` newtons or newton metres on one axis of the wrench.
inline Sample pushed(int axis, double value, Duration time = {}) {
  Sample s;
  s.status = Status::ok;
  s.capture_time = TimePoint(std::chrono::seconds(1000) + time);
  s.wrench[axis] = value;
  return s;
}

/// Round numbers, no filter, no noise: 1 N, 1 N, 2 N and 10 mN m, a tenth of it dead.
inline ShapingOptions plain_shaping() {
  ShapingOptions o;
  o.full_scale << 1, 1, 2, 0.01, 0.01, 0.01;
  o.dead_zone = 0.1 * o.full_scale;
  o.filter.kind = FilterKind::none;
  o.noise_sigmas = 0;
  return o;
}

/// A hand's way from 0 to 1 (Flash and Hogan, J. Neurosci. 5(7), 1985), `part` of its time on.
inline double minimum_jerk(double part) {
  if (part <= 0) return 0;
  if (part >= 1) return 1;
  return part * part * part * (10 - 15 * part + 6 * part * part);
}

inline Duration seconds_as_duration(double seconds) {
  return Duration(std::llround(seconds * 1e9));
}

}  // namespace tagwrench
