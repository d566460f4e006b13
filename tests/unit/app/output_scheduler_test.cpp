#include <gtest/gtest.h>

#include "host/app/pipeline.h"

namespace tagwrench::test {
namespace {

using std::chrono::milliseconds;
using Move = OutputScheduler::Move;

constexpr Duration kMovePeriod = milliseconds(8);
constexpr TimePoint kFirstMove{milliseconds(1000)};

TEST(OutputScheduler, WithoutARateDevicesMoveWithEverySample) {
  OutputScheduler scheduler;
  EXPECT_EQ(scheduler.sample(true, {}, kFirstMove), Move::with_sample);
  EXPECT_EQ(scheduler.sample(true, {}, kFirstMove + milliseconds(40)), Move::with_sample);
  EXPECT_EQ(scheduler.next(), TimePoint::max());
  EXPECT_FALSE(scheduler.due(kFirstMove + milliseconds(80), {}));
}

TEST(OutputScheduler, AtARateTheFirstMoveIsAtOnceAndTheNextOnePeriodLater) {
  OutputScheduler scheduler;
  EXPECT_EQ(scheduler.sample(true, kMovePeriod, kFirstMove), Move::on);
  EXPECT_EQ(scheduler.next(), kFirstMove + kMovePeriod);
  EXPECT_FALSE(scheduler.due(kFirstMove + kMovePeriod - milliseconds(1), kMovePeriod));
  EXPECT_TRUE(scheduler.due(kFirstMove + kMovePeriod, kMovePeriod));
  EXPECT_EQ(scheduler.next(), kFirstMove + 2 * kMovePeriod);
}

TEST(OutputScheduler, ASampleBetweenTwoMovesWaitsForTheClock) {
  OutputScheduler scheduler;
  scheduler.sample(true, kMovePeriod, kFirstMove);
  EXPECT_EQ(scheduler.sample(true, kMovePeriod, kFirstMove + milliseconds(3)), Move::none);
  EXPECT_EQ(scheduler.next(), kFirstMove + kMovePeriod) << "frames do not shift the clock";
  EXPECT_EQ(scheduler.sample(true, kMovePeriod, kFirstMove + milliseconds(9)), Move::on);
  EXPECT_EQ(scheduler.next(), kFirstMove + 2 * kMovePeriod);
}

TEST(OutputScheduler, WhatWasSleptThroughIsNotMadeUpFor) {
  OutputScheduler scheduler;
  scheduler.sample(true, kMovePeriod, kFirstMove);
  const TimePoint late = kFirstMove + milliseconds(100);
  EXPECT_TRUE(scheduler.due(late, kMovePeriod));
  EXPECT_FALSE(scheduler.due(late, kMovePeriod));
  EXPECT_EQ(scheduler.next(), late + kMovePeriod);
}

TEST(OutputScheduler, NeutralIsAtOnceAndThenDevicesRest) {
  OutputScheduler scheduler;
  scheduler.sample(true, kMovePeriod, kFirstMove);
  EXPECT_EQ(scheduler.sample(false, kMovePeriod, kFirstMove + milliseconds(1)), Move::with_sample);
  EXPECT_EQ(scheduler.next(), TimePoint::max());
  EXPECT_EQ(scheduler.sample(true, kMovePeriod, kFirstMove + milliseconds(2)), Move::on)
      << "held again: at once";
}

}  // namespace
}  // namespace tagwrench::test
