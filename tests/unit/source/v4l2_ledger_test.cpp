#include "host/source/v4l2_ledger.h"

#include <gtest/gtest.h>

namespace tagwrench {
namespace {

using namespace std::chrono_literals;

constexpr Duration kPeriod = 40ms;
constexpr TimePoint kStart{1000s};

BufferStamp stamp(std::uint32_t sequence, TimePoint driver, Duration age = 1ms,
                  bool monotonic = true) {
  return {sequence, driver, monotonic, driver + age};
}

/// A ledger whose stream has begun: the left-over is behind it.
FrameLedger running(std::uint32_t first = 0) {
  FrameLedger ledger(kPeriod);
  EXPECT_FALSE(ledger.note(stamp(first, kStart), false)) << "the first of a stream is discarded";
  return ledger;
}

TEST(Ledger, UnbrokenFramesLoseNothing) {
  FrameLedger ledger = running();
  for (std::uint32_t i = 1; i <= 5; ++i) {
    ASSERT_TRUE(ledger.note(stamp(i, kStart + i * kPeriod), false));
    EXPECT_EQ(ledger.sequence(), i - 1);
    EXPECT_EQ(ledger.take(), 0U);
  }
}

TEST(Ledger, GapsOfTheDriverAreLosses) {
  FrameLedger ledger = running();
  ledger.note(stamp(1, kStart + kPeriod), false);
  EXPECT_EQ(ledger.take(), 0U);
  ledger.note(stamp(5, kStart + 5 * kPeriod), false);
  EXPECT_EQ(ledger.take(), 3U);
  EXPECT_EQ(ledger.sequence(), 4U);
}

TEST(Ledger, DrainedFramesAreLosses) {
  FrameLedger ledger = running();
  ledger.note(stamp(1, kStart + kPeriod), false);
  ledger.take();
  for (std::uint32_t i = 2; i <= 4; ++i) ledger.note(stamp(i, kStart + i * kPeriod), false);
  EXPECT_EQ(ledger.take(), 2U);
}

TEST(Ledger, CountsAcrossTheWrapOfTheDriversCounter) {
  FrameLedger ledger = running(0xFFFFFFFD);
  ledger.note(stamp(0xFFFFFFFE, kStart + kPeriod), false);
  ledger.take();
  ledger.note(stamp(1, kStart + 4 * kPeriod), false);  // lost 0xFFFFFFFF and 0
  EXPECT_EQ(ledger.take(), 2U);
}

TEST(Ledger, ACounterThatStandsStillSaysNothingAboutLosses) {
  FrameLedger ledger = running();
  for (std::uint32_t i = 1; i <= 4; ++i) {
    ASSERT_TRUE(ledger.note(stamp(0, kStart + i * kPeriod), false));
    EXPECT_EQ(ledger.take(), 0U);
    EXPECT_EQ(ledger.sequence(), i - 1);
  }
}

TEST(Ledger, ACounterThatJumpsIsNotBelieved) {
  FrameLedger ledger = running(500);
  ledger.note(stamp(501, kStart + kPeriod), false);
  ledger.take();
  ledger.note(stamp(3, kStart + 2 * kPeriod), false);  // back
  EXPECT_EQ(ledger.take(), 0U);
  ledger.note(stamp(2000000, kStart + 3 * kPeriod), false);  // absurdly ahead
  EXPECT_EQ(ledger.take(), 0U);
  EXPECT_EQ(ledger.sequence(), 2U);
}

TEST(Ledger, TheLeftOverOfAStreamDoesNotCountAsAGap) {
  FrameLedger ledger(kPeriod);
  ASSERT_FALSE(ledger.note(stamp(0, kStart), false));
  ledger.note(stamp(700, kStart + kPeriod), false);
  EXPECT_EQ(ledger.take(), 0U);
  EXPECT_EQ(ledger.sequence(), 0U);
}

TEST(Ledger, NumbersGoOnAfterAReconnection) {
  FrameLedger ledger = running();
  ledger.note(stamp(1, kStart + kPeriod), false);
  ledger.note(stamp(2, kStart + 2 * kPeriod), false);
  ledger.take();
  ledger.stream_started();
  EXPECT_FALSE(ledger.note(stamp(0, kStart + 9s), false));
  EXPECT_TRUE(ledger.note(stamp(1, kStart + 9s + kPeriod), false));
  EXPECT_EQ(ledger.sequence(), 2U);
  EXPECT_EQ(ledger.take(), 0U);
}

TEST(Ledger, NumberingFromZeroForgetsTheSettling) {
  FrameLedger ledger = running();
  for (std::uint32_t i = 1; i < 20; ++i) ledger.note(stamp(i, kStart + i * kPeriod), true);
  ledger.number_from_zero();
  ledger.note(stamp(25, kStart + 25 * kPeriod), false);
  EXPECT_EQ(ledger.sequence(), 0U);
  EXPECT_EQ(ledger.take(), 0U);
  ledger.note(stamp(27, kStart + 27 * kPeriod), false);
  EXPECT_EQ(ledger.take(), 1U);
}

TEST(Ledger, KeepsTheKernelsCaptureTime) {
  FrameLedger ledger = running();
  ledger.note(stamp(1, kStart + kPeriod, 7ms), false);
  EXPECT_EQ(ledger.capture_time(), kStart + kPeriod);
  EXPECT_TRUE(ledger.trusts_driver_clock());
}

TEST(Ledger, AClockThatIsNotMonotonicIsReplacedByTheTimeOfDequeuing) {
  FrameLedger ledger = running();
  ledger.note(stamp(1, kStart + kPeriod, 7ms, false), false);
  EXPECT_EQ(ledger.capture_time(), kStart + kPeriod + 7ms);
  EXPECT_FALSE(ledger.trusts_driver_clock());
}

TEST(Ledger, AStampInTheFutureEndsTheTrustForGood) {
  FrameLedger ledger = running();
  ledger.note(stamp(1, kStart + kPeriod, -34ms), false);
  EXPECT_EQ(ledger.capture_time(), kStart + kPeriod - 34ms);
  ledger.note(stamp(2, kStart + 2 * kPeriod, 5ms), false);
  EXPECT_EQ(ledger.capture_time(), kStart + 2 * kPeriod + 5ms);
  EXPECT_FALSE(ledger.trusts_driver_clock());
}

TEST(Ledger, AnOldStampOnAFrameThatWasWaitedForIsAWrongClock) {
  FrameLedger ledger = running();
  ledger.note(stamp(1, kStart, 90s), true);
  EXPECT_FALSE(ledger.trusts_driver_clock());
  EXPECT_FALSE(ledger.stale(kStart + 90s, kStart + 90s, false));
}

TEST(Ledger, AnOldStampAfterASleepIsAnOldFrame) {
  FrameLedger ledger = running();
  ledger.note(stamp(1, kStart, 90s), false);
  EXPECT_TRUE(ledger.trusts_driver_clock());
  EXPECT_TRUE(ledger.stale(kStart + 90s, kStart + 90s, false));
}

TEST(Ledger, CaptureTimesIncreaseEvenIfTheDriversDoNot) {
  FrameLedger ledger = running();
  ledger.note(stamp(1, kStart + kPeriod), false);
  const TimePoint before = ledger.capture_time();
  ledger.note({2, kStart + kPeriod, true, kStart + 2 * kPeriod}, false);
  EXPECT_GT(ledger.capture_time(), before);
}

TEST(Ledger, StaleMeansOlderThanTwoPeriodsOr100ms) {
  FrameLedger fast = running();
  fast.note(stamp(1, kStart), false);
  EXPECT_FALSE(fast.stale(kStart + 100ms, kStart, false));
  EXPECT_TRUE(fast.stale(kStart + 101ms, kStart, false));
  FrameLedger slow(200ms);
  slow.note(stamp(0, kStart), false);
  slow.note(stamp(1, kStart), false);
  EXPECT_FALSE(slow.stale(kStart + 400ms, kStart, false));
  EXPECT_TRUE(slow.stale(kStart + 401ms, kStart, false));
}

TEST(Ledger, WithoutAClockAFullQueueAfterALongPauseIsStale) {
  FrameLedger ledger = running();
  ledger.note(stamp(1, kStart, 0ms, false), false);
  EXPECT_TRUE(ledger.stale(kStart, kStart - 2s, true));
  EXPECT_FALSE(ledger.stale(kStart, kStart - 2s, false)) << "the driver could still fill a buffer";
  EXPECT_FALSE(ledger.stale(kStart, kStart - 40ms, true)) << "no long pause";
}

}  // namespace
}  // namespace tagwrench
