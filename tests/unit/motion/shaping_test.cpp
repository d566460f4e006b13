// What moves, how far and which way: mounting, scale, curve, balance, locks, the strongest axis,
// and frames that come as they should not.
#include "host/motion/shaping.h"

#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <limits>
#include <random>

#include "tests/unit/motion/pushed.h"

namespace tagwrench {
namespace {

using std::chrono::milliseconds;

TEST(Shaping, RestIsExactlyZeroInsideTheDeadZone) {
  Sample s = pushed(0, 0.0999);
  Shaping(plain_shaping()).shape(s);
  EXPECT_EQ(s.deflection, Vector6::Zero().eval());
}

TEST(Shaping, IsContinuousAtTheEdgeOfTheDeadZoneAndReachesFullScale) {
  Sample s = pushed(0, 0.1 + 1e-9);
  Shaping(plain_shaping()).shape(s);
  EXPECT_NEAR(s.deflection[0], 0, 1e-8);
  s = pushed(0, 1.0);
  Shaping(plain_shaping()).shape(s);
  EXPECT_DOUBLE_EQ(s.deflection[0], 1.0);
  s = pushed(0, -7.0);
  Shaping(plain_shaping()).shape(s);
  EXPECT_DOUBLE_EQ(s.deflection[0], -1.0);
}

TEST(Shaping, WithoutADeadZoneTheSlightestPushMoves) {
  ShapingOptions o = plain_shaping();
  o.dead_zone.setZero();
  Shaping shaping(o);
  Sample s = pushed(0, 1e-6);
  shaping.shape(s);
  EXPECT_NEAR(s.deflection[0], 1e-6, 1e-11);
  s = pushed(0, 0, milliseconds(16));
  shaping.shape(s);
  EXPECT_EQ(s.deflection, Vector6::Zero().eval());
}

TEST(Shaping, DefaultMountingTurnsCameraAxesIntoHidAxes) {
  // The camera looks up: its y points away from the user and its z up; HID Y is toward the user,
  // HID Z down.
  const double expected_sign[6] = {1, -1, -1, 1, -1, -1};
  for (int axis = 0; axis < 6; ++axis) {
    Sample s = pushed(axis, 5.0);
    Shaping(plain_shaping()).shape(s);
    for (int i = 0; i < 6; ++i)
      EXPECT_EQ(s.deflection[i], i == axis ? expected_sign[axis] : 0.0) << axis << " " << i;
  }
}

TEST(Shaping, AStatusWithoutNumbersIsNeutral) {
  for (Status status : {Status::acquiring, Status::lost, Status::doubtful}) {
    Shaping shaping(plain_shaping());
    Sample s = pushed(2, 1.5);
    shaping.shape(s);
    ASSERT_NE(s.deflection[2], 0);
    s = pushed(2, 1.5, milliseconds(16));
    s.status = status;
    s.deflection.setOnes();
    shaping.shape(s);
    EXPECT_EQ(s.deflection, Vector6::Zero().eval());
    EXPECT_EQ(shaping.motion_at(s.capture_time + milliseconds(8)), Vector6::Zero().eval());
  }
}

TEST(Shaping, SaturatedStillMoves) {
  Sample s = pushed(0, 3);
  s.status = Status::saturated;
  Shaping(plain_shaping()).shape(s);
  EXPECT_EQ(s.deflection[0], 1.0);
}

TEST(Shaping, AnAxisTakesWhatItIsToldToTakeAndTurnsIt) {
  ShapingOptions o = plain_shaping();
  o.axes[5].source = 0;  // RZ from the force to the right
  o.axes[5].invert = true;
  o.full_scale[5] = 1;
  o.dead_zone[5] = 0.1;
  o.axes[0].source = 3;  // X from the tilt about it
  o.full_scale[0] = 0.01;
  o.dead_zone[0] = 0.001;
  Sample s = pushed(0, 5);
  Shaping(o).shape(s);
  EXPECT_EQ(s.deflection, (Vector6() << 0, 0, 0, 0, 0, -1).finished());
  s = pushed(3, 5);
  Shaping(o).shape(s);
  EXPECT_EQ(s.deflection, (Vector6() << 1, 0, 0, 1, 0, 0).finished());
}

TEST(Shaping, CurveThenBalanceThenLimit) {
  ShapingOptions o = plain_shaping();
  o.dead_zone.setConstant(1e-9);
  o.axes[0].curve = {.kind = CurveKind::power, .power = 2};
  o.translation = 1.5;
  Sample s = pushed(0, 0.5);
  Shaping(o).shape(s);
  EXPECT_NEAR(s.deflection[0], 1.5 * 0.25, 1e-6);
  o.axes[0].limit = 0.3;
  Shaping(o).shape(s);
  EXPECT_EQ(s.deflection[0], 0.3);
  o.rotation = 0.5;
  s = pushed(3, -0.01);
  Shaping(o).shape(s);
  EXPECT_DOUBLE_EQ(s.deflection[3], -0.5);
}

TEST(Shaping, ALockedHalfStaysZeroAndTheOtherMoves) {
  for (const Lock lock : {Lock::translation, Lock::rotation}) {
    ShapingOptions o = plain_shaping();
    o.lock = lock;
    Shaping shaping(o);
    Sample s = pushed(0, 5);
    s.wrench[3] = 5;
    shaping.shape(s);
    EXPECT_EQ(s.deflection[0], lock == Lock::translation ? 0 : 1);
    EXPECT_EQ(s.deflection[3], lock == Lock::rotation ? 0 : 1);
  }
}

TEST(Shaping, InDominantModeOnlyTheStrongestMovesAndALockedOneNeverWins) {
  ShapingOptions o = plain_shaping();
  o.dominant.on = true;
  Sample s = pushed(0, 0.6);
  s.wrench[3] = 0.009;
  Shaping(o).shape(s);
  EXPECT_EQ(s.deflection[0], 0);
  EXPECT_GT(s.deflection[3], 0.8);
  o.lock = Lock::rotation;
  Shaping(o).shape(s);
  EXPECT_GT(s.deflection[0], 0.5);
  EXPECT_EQ(s.deflection[3], 0);
}

TEST(Shaping, TheStrongestAxisDoesNotFlickerBetweenTwoThatAreAboutEqual) {
  ShapingOptions o = plain_shaping();
  o.dominant = {.on = true, .ratio = 1.3};
  Shaping shaping(o);
  int changes = 0;
  int winner = -1;
  std::mt19937 random(1);
  std::uniform_real_distribution<double> about(0.5, 0.6);  // up to 1.25 times after the dead zone
  for (int i = 0; i < 1000; ++i) {
    Sample s = pushed(0, about(random), milliseconds(16 * i));
    s.wrench[1] = -about(random);
    shaping.shape(s);
    EXPECT_EQ((s.deflection.array() != 0).count(), 1);
    const int now = s.deflection[0] != 0 ? 0 : 1;
    changes += winner >= 0 && now != winner;
    winner = now;
  }
  EXPECT_EQ(changes, 0);
  Sample s = pushed(winner, 0.5, milliseconds(16'000));
  s.wrench[1 - winner] = winner == 0 ? -0.7 : 0.7;
  shaping.shape(s);
  EXPECT_NE(s.deflection[1 - winner], 0) << "clearly stronger, it takes over";
}

TEST(Shaping, AWrenchThatIsNotFiniteIsZeroAndForgotten) {
  for (const double bad :
       {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) {
    ShapingOptions o = plain_shaping();
    o.filter.kind = FilterKind::exponential;
    Shaping shaping(o);
    Sample s = pushed(0, -0.9);
    shaping.shape(s);
    s = pushed(4, bad, milliseconds(16));
    shaping.shape(s);
    EXPECT_EQ(s.deflection, Vector6::Zero().eval());
    s = pushed(0, 0.55, milliseconds(32));
    shaping.shape(s);
    EXPECT_NEAR(s.deflection[0], 0.5, 0.04) << "as if nothing had been before";
  }
}

TEST(Shaping, APushBeyondAllMeasureIsAFullOneAndNoLonger) {
  ShapingOptions o = plain_shaping();
  o.filter.kind = FilterKind::one_euro;
  Shaping shaping(o);
  Sample s = pushed(0, 0.5);
  shaping.shape(s);
  s = pushed(0, 1.7e308, milliseconds(16));
  s.wrench_sigma.setConstant(1.7e308);
  shaping.shape(s);
  EXPECT_GT(s.deflection[0], 0.9);
  for (int i = 2; i < 40; ++i) {
    s = pushed(0, 0.55, milliseconds(16 * i));
    shaping.shape(s);
  }
  EXPECT_NEAR(s.deflection[0], 0.5, 0.04) << "0.6 s later";
}

TEST(Shaping, AnOlderFrameChangesNothing) {
  Shaping shaping(plain_shaping());
  Sample s = pushed(0, 0.55, milliseconds(100));
  shaping.shape(s);
  const Vector6 motion = s.deflection;
  ASSERT_NE(motion[0], 0);
  for (const milliseconds time : {milliseconds(99), milliseconds(100)}) {
    s = pushed(0, -1, time);
    shaping.shape(s);
    EXPECT_EQ(s.deflection, motion);
  }
}

TEST(Shaping, AfterALongGapTheFilterDoesNotRemember) {
  ShapingOptions o = plain_shaping();
  o.filter.kind = FilterKind::exponential;
  for (const milliseconds time : {milliseconds(600), milliseconds(-600)}) {
    Shaping shaping(o);
    Sample s = pushed(0, 1);
    shaping.shape(s);
    s = pushed(0, -1, time);
    shaping.shape(s);
    EXPECT_EQ(s.deflection[0], -1) << "a clock that begins again counts as a gap";
  }
}

TEST(Shaping, OtherOptionsCountFromTheNextFrameAndNoMotionIsLostBetween) {
  ShapingOptions o = plain_shaping();
  Shaping shaping(o);
  Sample s = pushed(0, 1);
  shaping.shape(s);
  o.translation = 0.5;
  shaping.change(o);
  EXPECT_EQ(shaping.motion_at(s.capture_time + milliseconds(10))[0], 1);
  s = pushed(0, 1, milliseconds(16));
  shaping.shape(s);
  EXPECT_EQ(s.deflection[0], 0.5);
}

TEST(Shaping, WhatIsSuppressedDoesNotMove) {
  Shaping shaping(plain_shaping());
  Sample s = pushed(0, 1);
  shaping.shape(s);
  shaping.suppress(s);
  EXPECT_EQ(s.deflection, Vector6::Zero().eval());
  EXPECT_EQ(shaping.motion_at(s.capture_time), Vector6::Zero().eval());
}

TEST(Shaping, WhateverComesMotionIsFiniteAndWithinItsLimits) {
  std::mt19937_64 random(3);
  const auto any_number = [&] {
    const std::uint64_t bits = random();
    if (bits % 4 == 0) return std::bit_cast<double>(random());  // NaN, infinity, 1e-300 too
    return std::normal_distribution<double>(0, 1)(random);
  };
  for (int kind = 0; kind < 3; ++kind) {
    ShapingOptions o = plain_shaping();
    o.filter.kind = static_cast<FilterKind>(kind);
    o.noise_sigmas = 6;
    o.translation = 3;
    o.dominant.on = kind == 1;
    for (AxisOptions& axis : o.axes) axis.limit = 0.8;
    Shaping shaping(o);
    TimePoint time{};
    for (int i = 0; i < 20'000; ++i) {
      Sample s;
      s.status = random() % 50 == 0 ? Status::lost : Status::ok;
      const bool sane = random() % 8 != 0;
      for (int axis = 0; axis < 6; ++axis) {
        s.wrench[axis] =
            sane ? std::uniform_real_distribution<double>(-2, 2)(random) : any_number();
        s.wrench_sigma[axis] = sane ? 1e-3 : any_number();
      }
      time += Duration(static_cast<std::int64_t>(random() % 40'000'000) - 5'000'000);
      s.capture_time = time;
      shaping.shape(s);
      ASSERT_TRUE((s.deflection.array().abs() <= 0.8).all())
          << i << ": " << s.deflection.transpose();
      const Vector6 between = shaping.motion_at(time + Duration(random() % 100'000'000));
      ASSERT_TRUE((between.array().abs() <= 0.8).all()) << i << ": " << between.transpose();
    }
  }
}

}  // namespace
}  // namespace tagwrench
