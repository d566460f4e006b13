#include <gtest/gtest.h>

#include <limits>

#include "host/tools/camera_timing/flip_patches.h"

namespace tagwrench {
namespace {

using namespace std::chrono_literals;

constexpr TimePoint kStart{5h};  // of the host; the page began to count then

double in_ms(TimePoint host) {
  return std::chrono::duration<double, std::milli>(host - kStart).count();
}

TEST(PageClock, HoursBetweenTheClocksAreRecoveredToHalfTheShortestWayThereAndBack) {
  PageClock clock;
  const TimePoint at = kStart + 10s;
  EXPECT_TRUE(clock.exchange(at, in_ms(at + 9ms), at + 10ms));  // slow on the way there
  EXPECT_EQ(clock.error(), 5ms);
  EXPECT_TRUE(clock.exchange(at + 20ms, in_ms(at + 21ms), at + 22ms));
  EXPECT_EQ(clock.error(), 1ms);
  EXPECT_TRUE(clock.exchange(at + 30ms, in_ms(at + 31ms), at + 130ms));  // slow: left aside
  ASSERT_TRUE(clock.host_time(in_ms(at + 1s)));
  EXPECT_LT(std::chrono::abs(*clock.host_time(in_ms(at + 1s)) - (at + 1s)), 2us);
  EXPECT_EQ(clock.exchanges(), 3);
}

TEST(PageClock, DriftsApartUntilAnotherExchangeIsBetter) {
  PageClock clock;
  clock.exchange(kStart, 0, kStart + 2ms);
  // Ten minutes at 100 ppm are 60 ms: an exchange of 20 ms is better than that.
  const TimePoint later = kStart + 600s;
  clock.exchange(later, in_ms(later) + 40, later + 20ms);  // 30 ms ahead by now
  EXPECT_EQ(clock.error(), 10ms);
  EXPECT_LT(std::chrono::abs(*clock.host_time(in_ms(later) + 40) - (later + 10ms)), 2us);
}

TEST(PageClock, WhatNoClockReadsIsLeftOut) {
  PageClock clock;
  EXPECT_FALSE(clock.host_time(5));
  for (const double reading : {-1.0, 1e300, std::numeric_limits<double>::quiet_NaN(),
                               std::numeric_limits<double>::infinity()}) {
    EXPECT_FALSE(clock.exchange(kStart, reading, kStart + 1ms)) << reading;
    EXPECT_FALSE(clock.host_time(reading)) << reading;
  }
  EXPECT_FALSE(clock.exchange(kStart, 1, kStart - 1ms)) << "an answer before the question";
  EXPECT_EQ(clock.exchanges(), 0);
}

}  // namespace
}  // namespace tagwrench
