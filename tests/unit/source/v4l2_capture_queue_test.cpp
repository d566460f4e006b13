#include <gtest/gtest.h>

#include "host/source/v4l2_source.h"

namespace tagwrench {
namespace {

using namespace std::chrono_literals;

constexpr Duration kPeriod = 40ms;
constexpr TimePoint kStart{1000s};

BufferStamp stamp(std::uint32_t sequence, TimePoint driver, Duration age = 1ms,
                  bool monotonic = true) {
  return {sequence, driver, monotonic, driver + age};
}

/// A capture_queue whose stream has begun: the left-over is behind it.
CaptureQueueTracker running(std::uint32_t first = 0) {
  CaptureQueueTracker capture_queue(kPeriod);
  EXPECT_FALSE(capture_queue.note(stamp(first, kStart), false))
      << "the first of a stream is discarded";
  return capture_queue;
}

TEST(CaptureQueue, UnbrokenFramesLoseNothing) {
  CaptureQueueTracker capture_queue = running();
  for (std::uint32_t i = 1; i <= 5; ++i) {
    ASSERT_TRUE(capture_queue.note(stamp(i, kStart + i * kPeriod), false));
    EXPECT_EQ(capture_queue.sequence(), i - 1);
    EXPECT_EQ(capture_queue.take(), 0U);
  }
}

TEST(CaptureQueue, GapsOfTheDriverAreLosses) {
  CaptureQueueTracker capture_queue = running();
  capture_queue.note(stamp(1, kStart + kPeriod), false);
  EXPECT_EQ(capture_queue.take(), 0U);
  capture_queue.note(stamp(5, kStart + 5 * kPeriod), false);
  EXPECT_EQ(capture_queue.take(), 3U);
  EXPECT_EQ(capture_queue.sequence(), 4U);
}

TEST(CaptureQueue, DrainedFramesAreLosses) {
  CaptureQueueTracker capture_queue = running();
  capture_queue.note(stamp(1, kStart + kPeriod), false);
  capture_queue.take();
  for (std::uint32_t i = 2; i <= 4; ++i) capture_queue.note(stamp(i, kStart + i * kPeriod), false);
  EXPECT_EQ(capture_queue.take(), 2U);
}

TEST(CaptureQueue, CountsAcrossTheWrapOfTheDriversCounter) {
  CaptureQueueTracker capture_queue = running(0xFFFFFFFD);
  capture_queue.note(stamp(0xFFFFFFFE, kStart + kPeriod), false);
  capture_queue.take();
  capture_queue.note(stamp(1, kStart + 4 * kPeriod), false);  // lost 0xFFFFFFFF and 0
  EXPECT_EQ(capture_queue.take(), 2U);
}

TEST(CaptureQueue, ACounterThatStandsStillSaysNothingAboutLosses) {
  CaptureQueueTracker capture_queue = running();
  for (std::uint32_t i = 1; i <= 4; ++i) {
    ASSERT_TRUE(capture_queue.note(stamp(0, kStart + i * kPeriod), false));
    EXPECT_EQ(capture_queue.take(), 0U);
    EXPECT_EQ(capture_queue.sequence(), i - 1);
  }
}

TEST(CaptureQueue, ACounterThatJumpsIsNotBelieved) {
  CaptureQueueTracker capture_queue = running(500);
  capture_queue.note(stamp(501, kStart + kPeriod), false);
  capture_queue.take();
  capture_queue.note(stamp(3, kStart + 2 * kPeriod), false);  // back
  EXPECT_EQ(capture_queue.take(), 0U);
  capture_queue.note(stamp(2000000, kStart + 3 * kPeriod), false);  // absurdly ahead
  EXPECT_EQ(capture_queue.take(), 0U);
  EXPECT_EQ(capture_queue.sequence(), 2U);
}

TEST(CaptureQueue, TheLeftOverOfAStreamDoesNotCountAsAGap) {
  CaptureQueueTracker capture_queue(kPeriod);
  ASSERT_FALSE(capture_queue.note(stamp(0, kStart), false));
  capture_queue.note(stamp(700, kStart + kPeriod), false);
  EXPECT_EQ(capture_queue.take(), 0U);
  EXPECT_EQ(capture_queue.sequence(), 0U);
}

TEST(CaptureQueue, NumbersGoOnAfterAReconnection) {
  CaptureQueueTracker capture_queue = running();
  capture_queue.note(stamp(1, kStart + kPeriod), false);
  capture_queue.note(stamp(2, kStart + 2 * kPeriod), false);
  capture_queue.take();
  capture_queue.stream_started();
  EXPECT_FALSE(capture_queue.note(stamp(0, kStart + 9s), false));
  EXPECT_TRUE(capture_queue.note(stamp(1, kStart + 9s + kPeriod), false));
  EXPECT_EQ(capture_queue.sequence(), 2U);
  EXPECT_EQ(capture_queue.take(), 0U);
}

TEST(CaptureQueue, NumberingFromZeroForgetsTheSettling) {
  CaptureQueueTracker capture_queue = running();
  for (std::uint32_t i = 1; i < 20; ++i) capture_queue.note(stamp(i, kStart + i * kPeriod), true);
  capture_queue.number_from_zero();
  capture_queue.note(stamp(25, kStart + 25 * kPeriod), false);
  EXPECT_EQ(capture_queue.sequence(), 0U);
  EXPECT_EQ(capture_queue.take(), 0U);
  capture_queue.note(stamp(27, kStart + 27 * kPeriod), false);
  EXPECT_EQ(capture_queue.take(), 1U);
}

TEST(CaptureQueue, KeepsTheKernelsCaptureTime) {
  CaptureQueueTracker capture_queue = running();
  capture_queue.note(stamp(1, kStart + kPeriod, 7ms), false);
  EXPECT_EQ(capture_queue.capture_time(), kStart + kPeriod);
  EXPECT_TRUE(capture_queue.trusts_driver_clock());
}

TEST(CaptureQueue, AClockThatIsNotMonotonicIsReplacedByTheTimeOfDequeuing) {
  CaptureQueueTracker capture_queue = running();
  capture_queue.note(stamp(1, kStart + kPeriod, 7ms, false), false);
  EXPECT_EQ(capture_queue.capture_time(), kStart + kPeriod + 7ms);
  EXPECT_FALSE(capture_queue.trusts_driver_clock());
}

TEST(CaptureQueue, AStampInTheFutureEndsTheTrustForGood) {
  CaptureQueueTracker capture_queue = running();
  capture_queue.note(stamp(1, kStart + kPeriod, -34ms), false);
  EXPECT_EQ(capture_queue.capture_time(), kStart + kPeriod - 34ms);
  capture_queue.note(stamp(2, kStart + 2 * kPeriod, 5ms), false);
  EXPECT_EQ(capture_queue.capture_time(), kStart + 2 * kPeriod + 5ms);
  EXPECT_FALSE(capture_queue.trusts_driver_clock());
}

TEST(CaptureQueue, AnOldStampOnAFrameThatWasWaitedForIsAWrongClock) {
  CaptureQueueTracker capture_queue = running();
  capture_queue.note(stamp(1, kStart, 90s), true);
  EXPECT_FALSE(capture_queue.trusts_driver_clock());
  EXPECT_FALSE(capture_queue.stale(kStart + 90s, kStart + 90s, false));
}

TEST(CaptureQueue, AnOldStampAfterASleepIsAnOldFrame) {
  CaptureQueueTracker capture_queue = running();
  capture_queue.note(stamp(1, kStart, 90s), false);
  EXPECT_TRUE(capture_queue.trusts_driver_clock());
  EXPECT_TRUE(capture_queue.stale(kStart + 90s, kStart + 90s, false));
}

TEST(CaptureQueue, CaptureTimesIncreaseEvenIfTheDriversDoNot) {
  CaptureQueueTracker capture_queue = running();
  capture_queue.note(stamp(1, kStart + kPeriod), false);
  const TimePoint before = capture_queue.capture_time();
  capture_queue.note({2, kStart + kPeriod, true, kStart + 2 * kPeriod}, false);
  EXPECT_GT(capture_queue.capture_time(), before);
}

TEST(CaptureQueue, StaleMeansOlderThanTwoPeriodsOr100ms) {
  CaptureQueueTracker fast = running();
  fast.note(stamp(1, kStart), false);
  EXPECT_FALSE(fast.stale(kStart + 100ms, kStart, false));
  EXPECT_TRUE(fast.stale(kStart + 101ms, kStart, false));
  CaptureQueueTracker slow(200ms);
  slow.note(stamp(0, kStart), false);
  slow.note(stamp(1, kStart), false);
  EXPECT_FALSE(slow.stale(kStart + 400ms, kStart, false));
  EXPECT_TRUE(slow.stale(kStart + 401ms, kStart, false));
}

TEST(CaptureQueue, WithoutAClockAFullQueueAfterALongPauseIsStale) {
  CaptureQueueTracker capture_queue = running();
  capture_queue.note(stamp(1, kStart, 0ms, false), false);
  EXPECT_TRUE(capture_queue.stale(kStart, kStart - 2s, true));
  EXPECT_FALSE(capture_queue.stale(kStart, kStart - 2s, false))
      << "the driver could still fill a buffer";
  EXPECT_FALSE(capture_queue.stale(kStart, kStart - 40ms, true)) << "no long pause";
}

}  // namespace
}  // namespace tagwrench
