#include "host/wrench/zero.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <random>

namespace tagwrench {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

constexpr Duration kFrame = milliseconds(40);

Vector6 range() { return (Vector6() << 1, 1, 3, 0.02, 0.02, 0.01).finished(); }
Vector6 noise() { return range() * 6e-4; }  // the simulated sensor's in depth

ZeroOptions zero_options() {
  ZeroOptions o;
  o.range = range();
  return o;
}

/// The wrench at a time (s), with noise, fed to `zero`; the last sample.
Sample play(ZeroTracking& zero, double from, double to,
            const std::function<Vector6(double)>& wrench, unsigned seed = 1,
            const std::function<void(Sample&)>& alter = {}) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  Sample sample;
  const double period = std::chrono::duration<double>(kFrame).count();
  for (double t = from; t < to; t += period) {
    sample = Sample{};
    sample.capture_time = TimePoint(Duration(std::llround(t * 1e9)));
    sample.status = Status::ok;
    sample.wrench = wrench(t);
    for (int i = 0; i < 6; ++i) sample.wrench[i] += noise()[i] * normal(random);
    if (alter) alter(sample);
    zero.follow(sample, noise());
  }
  return sample;
}

Vector6 fraction_of_range(double part) { return part * range(); }

double largest_fraction(const Vector6& wrench) {
  return (wrench.array() / range().array()).abs().maxCoeff();
}

TEST(Zero, SlowDriftIsFollowed) {
  ZeroTracking zero(zero_options());
  // 1.5 % of the range in an hour.
  const Sample last =
      play(zero, 0, 3600, [](double t) { return fraction_of_range(0.015 * t / 3600); });
  EXPECT_EQ(last.zero_state, ZeroState::following);
  EXPECT_LT(largest_fraction(zero.moved() - fraction_of_range(0.015)), 3e-4);
  EXPECT_EQ(last.zero, zero.moved());
}

TEST(Zero, ALoadOfFivePercentIsNeverEatenInAnHour) {
  for (const double put_on : {0.0, 10.0}) {
    ZeroTracking zero(zero_options());
    const Sample last = play(zero, 0, 3600, [&](double t) {
      return t < put_on ? Vector6::Zero().eval() : (Vector6() << 0, 0, 0.15, 0, 0, 0).finished();
    });
    EXPECT_EQ(last.zero_state, ZeroState::far);
    EXPECT_LT(largest_fraction(zero.moved()), 3e-4) << "put on after " << put_on << " s";
    EXPECT_NEAR(last.wrench[2], 0.15, 8e-3);  // N
  }
}

TEST(Zero, ALightLoadThatIsPutOnIsNotEatenEither) {
  ZeroTracking zero(zero_options());
  play(zero, 0, 600, [](double t) {  // 1 % of the range: 3 g
    return t < 5 ? Vector6::Zero().eval() : (Vector6() << 0, 0, 0.03, 0, 0, 0).finished();
  });
  EXPECT_LT(largest_fraction(zero.moved()), 3e-4);
}

TEST(Zero, WhatStandsAtTheStartIsFollowedWithinTheBandAlone) {
  ZeroTracking near(zero_options());
  play(near, 0, 300, [](double) { return fraction_of_range(-0.015); });
  EXPECT_LT(largest_fraction(near.moved() - fraction_of_range(-0.015)), 3e-4);

  ZeroTracking drifting(zero_options());  // slowly through the whole band, and on
  const Sample last =
      play(drifting, 0, 3600, [](double t) { return fraction_of_range(0.06 * t / 3600); });
  EXPECT_LE(largest_fraction(drifting.moved()), 0.02 + 1e-12);
  EXPECT_GT(largest_fraction(drifting.moved()), 0.0195);
  EXPECT_EQ(last.zero_state, ZeroState::far);
}

TEST(Zero, AHandThatRestsOnTheSensorIsNotEaten) {
  // 0.4 % of the range, with the few percent of tremor and sway that no hand is without.
  std::mt19937 random(7);
  std::normal_distribution<double> normal;
  double sway = 0;
  ZeroTracking zero(zero_options());
  play(zero, 0, 600, [&](double t) {
    if (t < 3) return Vector6::Zero().eval();
    sway = 0.97 * sway + 0.3 * normal(random);
    return (fraction_of_range(0.004) * (1 + 0.5 * std::sin(2 * M_PI * 0.4 * t) + 0.6 * sway))
        .eval();
  });
  EXPECT_LT(largest_fraction(zero.moved()), 5e-4);
}

TEST(Zero, MovesNoFasterThanHalfAScaleIntervalASecond) {
  ZeroTracking zero(zero_options());
  const Vector6 load = fraction_of_range(0.018);
  play(zero, 0, 30, [&](double) { return load; });
  EXPECT_LE(largest_fraction(zero.moved()), 30 * 0.5 / 3000);
  EXPECT_GT(largest_fraction(zero.moved()), 28 * 0.5 / 3000);
}

TEST(Zero, NoiseHardlyMovesIt) {
  ZeroTracking zero(zero_options());
  play(zero, 0, 120, [](double) { return Vector6::Zero(); });
  // A part of the noise of one frame.
  EXPECT_LT((zero.moved().array() / noise().array()).abs().maxCoeff(), 0.25);
}

TEST(Zero, StaysWhileAButtonIsPressed) {
  ZeroTracking zero(zero_options());
  const Sample last = play(
      zero, 0, 300, [](double) { return fraction_of_range(0.004); }, 1,
      [](Sample& s) { s.touched = true; });
  EXPECT_EQ(last.zero_state, ZeroState::touched);
  EXPECT_EQ(zero.moved(), Vector6::Zero().eval());
}

TEST(Zero, StaysWhileNothingIsHeldAndSettlesAnewAfterwards) {
  ZeroTracking zero(zero_options());
  play(zero, 0, 60, [](double) { return fraction_of_range(0.004); });
  const Vector6 before = zero.moved();
  Sample last = play(
      zero, 60, 120, [](double) { return fraction_of_range(0.5); }, 2,
      [](Sample& s) {
        s.status = Status::lost;
        s.wrench.setZero();
      });
  EXPECT_EQ(zero.moved(), before);
  EXPECT_EQ(last.wrench, Vector6::Zero().eval()) << "a status without numbers has none";
  last = play(zero, 120, 120.9, [](double) { return fraction_of_range(0.004); });
  EXPECT_EQ(last.zero_state, ZeroState::touched) << "not yet still for a second";
  EXPECT_EQ(zero.moved(), before);
}

TEST(Zero, WhatWasSetIsTakenOffFromTheFirstSample) {
  ZeroOptions o = zero_options();
  o.set = fraction_of_range(0.08);
  ZeroTracking zero(o);
  const Sample first = play(zero, 0, 0.01, [](double) { return fraction_of_range(0.08); });
  EXPECT_LT(largest_fraction(first.wrench), 4e-3);
  EXPECT_EQ(first.zero, o.set);
  // The band counts from there.
  play(zero, 1, 1200, [](double) { return fraction_of_range(0.095); });
  EXPECT_LT(largest_fraction(zero.moved() - fraction_of_range(0.015)), 4e-4);
}

TEST(Zero, SwitchedOffOrWithoutARangeItStays) {
  ZeroOptions off = zero_options();
  off.follow = false;
  ZeroOptions unknown = zero_options();
  unknown.range.setConstant(1e9);
  for (const ZeroOptions& o : {off, unknown}) {
    ZeroTracking zero(o);
    const Sample last = play(zero, 0, 60, [](double) { return fraction_of_range(0.004); });
    EXPECT_FALSE(zero.follows());
    EXPECT_EQ(last.zero_state, ZeroState::off);
    EXPECT_EQ(zero.moved(), Vector6::Zero().eval());
  }
}

TEST(Zero, AnAxisWithoutARangeIsLeftAlone) {
  ZeroOptions o = zero_options();
  o.range[5] = 0;
  ZeroTracking zero(o);
  play(zero, 0, 120, [](double) { return fraction_of_range(0.004); });
  EXPECT_EQ(zero.moved()[5], 0);
  EXPECT_NEAR(zero.moved()[2], 0.012, 2e-3);  // N
}

TEST(Zero, DependsOnTheSamplesAndTheirTimesAlone) {
  const auto moved = [] {
    ZeroTracking zero(zero_options());
    play(zero, 0, 100, [](double t) { return fraction_of_range(0.002 + 1e-5 * t); });
    return zero.moved();
  };
  EXPECT_EQ(moved(), moved());
}

TEST(Zero, TimeThatRunsBackwardsStartsTheStillnessAnew) {
  ZeroTracking zero(zero_options());
  play(zero, 100, 160, [](double) { return fraction_of_range(0.004); });
  const Vector6 before = zero.moved();
  const Sample last = play(zero, 0, 0.9, [](double) { return fraction_of_range(0.004); });
  EXPECT_EQ(last.zero_state, ZeroState::touched);
  EXPECT_EQ(zero.moved(), before);
}

TEST(Zero, TheRangeAboutAnOffsetOriginHasTheLeverInIt) {
  Matrix6 tool = Matrix6::Identity();
  tool(3, 1) = 0.1;  // m
  const Vector6 felt = range_through(tool, range());
  EXPECT_DOUBLE_EQ(felt[3], 0.02 + 0.1);  // N m
  EXPECT_DOUBLE_EQ(felt[4], 0.02);
  Vector6 unknown = range();
  unknown[1] = 1e9;
  EXPECT_EQ(range_through(tool, unknown)[3], 0) << "not known, for its part is not";
}

TEST(ZeroOnDemand, TakesOffWhatReadsAtRest) {
  for (const bool follow : {true, false}) {
    ZeroOptions o = zero_options();
    o.follow = follow;
    ZeroTracking zero(o);
    const auto offset = [](double) { return fraction_of_range(0.05); };
    play(zero, 0, 3, offset);
    zero.ask();
    const Sample last = play(zero, 3, 4, offset, 2);
    EXPECT_EQ(zero.take_answer(), ZeroAnswer::done);
    EXPECT_EQ(zero.take_answer(), ZeroAnswer::none) << "told once";
    EXPECT_LT(largest_fraction(last.zero - fraction_of_range(0.05)), 1e-3);
    EXPECT_EQ(last.zero_state, follow ? ZeroState::following : ZeroState::off);
  }
}

TEST(ZeroOnDemand, WaitsUntilTheHandIsGone) {
  ZeroTracking zero(zero_options());
  const auto let_go = [](double t) {
    return fraction_of_range(t < 4 ? 0.3 * std::sin(7 * t) : 0.01);
  };
  play(zero, 0, 2, let_go);
  zero.ask();
  play(zero, 2, 3, let_go, 2);
  EXPECT_EQ(zero.take_answer(), ZeroAnswer::waits);
  zero.ask();
  play(zero, 3, 4, let_go, 3);
  EXPECT_EQ(zero.take_answer(), ZeroAnswer::none) << "a key held down says it once";
  EXPECT_TRUE(zero.moved().isZero());
  const Sample last = play(zero, 4, 12, let_go, 3);
  EXPECT_EQ(zero.take_answer(), ZeroAnswer::done);
  EXPECT_LT(largest_fraction(last.zero - fraction_of_range(0.01)), 1e-3);
}

TEST(ZeroOnDemand, IsRefusedWhileHeldUnderALoadAndWithoutARange) {
  const auto held = [](double t) { return fraction_of_range(0.02 + 0.02 * std::sin(60 * t)); };
  const auto loaded = [](double) { return fraction_of_range(0.3); };
  for (const bool load : {false, true}) {
    ZeroTracking zero(zero_options());
    const auto wrench = load ? std::function<Vector6(double)>(loaded) : held;
    play(zero, 0, 3, wrench);
    zero.ask();
    const Sample last = play(zero, 3, 14, wrench, 2);
    EXPECT_EQ(zero.take_answer(), load ? ZeroAnswer::loaded : ZeroAnswer::moving);
    EXPECT_TRUE(last.zero.isZero());
  }
  ZeroTracking unknown{ZeroOptions{}};
  unknown.ask();
  play(unknown, 0, 1, loaded);
  EXPECT_EQ(unknown.take_answer(), ZeroAnswer::no_range);
}

TEST(ZeroAfterSleep, TakesOffWhatCoolingHasMovedAtOnceButNoLoad) {
  const auto touch_then = [](double part) {
    return [part](double t) { return fraction_of_range(t < 2 ? 0.3 * std::sin(7 * t) : part); };
  };
  ZeroTracking cooled(zero_options());
  play(cooled, 0, 2, touch_then(0.015));
  cooled.wake();
  const Sample last = play(cooled, 2, 11, touch_then(0.015), 2);
  EXPECT_EQ(cooled.take_answer(), ZeroAnswer::done);
  EXPECT_LT(largest_fraction(last.zero - fraction_of_range(0.015)), 1e-3);

  ZeroTracking carried(zero_options());
  const auto lifted = [](double t) {
    return fraction_of_range(t < 2 ? 0.3 * std::sin(7 * t) : t < 14 ? 0.019 : 0.0);
  };
  play(carried, 0, 3, lifted);
  carried.wake();
  EXPECT_GT(largest_fraction(play(carried, 3, 14, lifted, 2).zero), 0.018);
  EXPECT_LT(largest_fraction(play(carried, 14, 24, lifted, 3).zero), 1e-3) << "it was a load";

  ZeroTracking loaded(zero_options());
  play(loaded, 0, 2, touch_then(0.05));
  loaded.wake();
  play(loaded, 2, 14, touch_then(0.05), 2);
  EXPECT_EQ(loaded.take_answer(), ZeroAnswer::none) << "nobody asked";
  EXPECT_TRUE(play(loaded, 14, 15, touch_then(0.05), 3).zero.isZero());

  ZeroOptions fixed = zero_options();
  fixed.follow = false;
  ZeroTracking stays(fixed);
  stays.wake();
  EXPECT_TRUE(play(stays, 0, 6, touch_then(0.015), 2).zero.isZero());
}

}  // namespace
}  // namespace tagwrench
