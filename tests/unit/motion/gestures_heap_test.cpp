// Gestures without the heap.
#include <gtest/gtest.h>

#include <cmath>

#include "host/motion/gestures.h"
#include "tests/support/heap_count.h"

namespace tagwrench {
namespace {

TEST(GesturesHeap, AreFeltWithoutIt) {
  GestureOptions options;
  options.hid_R_camera.setIdentity();
  options.tap.button = 0;
  options.twist_left.button = 1;
  Gestures gestures(options);
  int taps = 0;
  test::start_counting_allocations();
  for (int frame = 0; frame < 6000; ++frame) {
    const int phase = frame % 60;  // a tap a second, of five frames
    Sample sample;
    sample.status = frame % 500 == 499 ? Status::lost : Status::ok;
    sample.capture_time = TimePoint(std::chrono::microseconds(16'667) * frame);
    sample.wrench[2] = phase < 6 ? std::sin(M_PI * phase / 6) : 0.0;
    if (gestures.feel(sample).recognised == Gesture::tap) ++taps;
  }
  EXPECT_EQ(test::stop_counting_allocations(), 0);
  EXPECT_GT(taps, 80);
}

}  // namespace
}  // namespace tagwrench
