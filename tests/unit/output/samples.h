// Samples that the output tests share.
#pragma once

#include <chrono>

#include "host/core/types.h"

namespace tagwrench::test {

inline tagwrench::Sample ok_sample() {
  tagwrench::Sample s;
  s.sequence = 41;
  s.capture_time = tagwrench::TimePoint(std::chrono::nanoseconds(123456789));
  s.latency_origin = s.capture_time;
  s.output_time = s.latency_origin + std::chrono::microseconds(812);
  s.status = tagwrench::Status::ok;
  s.displacement << 1e-6, -2e-6, 0.5, 0.125, 0, -1;
  s.displacement_sigma << 1e-7, 2e-7, 3e-7, 4e-5, 5e-5, 6e-5;
  s.wrench << 0.1, -0.25, 3, 0.001, -0.002, 0;
  s.wrench_sigma << 0.01, 0.02, 0.03, 1e-4, 2e-4, 3e-4;
  s.dropped = 2;
  return s;
}

inline tagwrench::Sample moving(double x) {
  tagwrench::Sample s = ok_sample();
  s.deflection[0] = x;
  return s;
}

}  // namespace tagwrench::test
