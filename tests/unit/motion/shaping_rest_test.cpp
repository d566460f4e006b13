// Rest: exactly zero for an hour, without a numb centre, left and reached without a jump, and at
// once when the hand lets go.
#include <gtest/gtest.h>

#include <cstdio>
#include <functional>
#include <numbers>
#include <random>
#include <vector>

#include "tests/unit/motion/pushed.h"

namespace tagwrench {
namespace {

constexpr double kFps = 60;
constexpr FilterKind kFilters[] = {FilterKind::none, FilterKind::exponential, FilterKind::one_euro};
constexpr const char* kFilterNames[] = {"none", "exponential", "One Euro"};

/// One standard deviation of the simulated published sensor's noise at rest, N and N m. What its
/// samples state is within 8 % of it.
const Vector6 kNoise = (Vector6() << 0.10e-3, 0.05e-3, 0.54e-3, 2.8e-6, 6.5e-6, 0.5e-6).finished();

/// A simulated sensor: any push, noise on all axes.
class NoisySensor {
 public:
  explicit NoisySensor(unsigned seed) : random_(seed) {}
  Sample sample(const Vector6& push, const Vector6& noise) {
    Sample s = pushed(0, 0, seconds_as_duration(frames_++ / kFps));
    for (int i = 0; i < 6; ++i) s.wrench[i] = push[i] + noise[i] * normal_(random_);
    s.wrench_sigma = kNoise;
    return s;
  }

 private:
  std::mt19937_64 random_;
  std::normal_distribution<double> normal_;
  int frames_ = 0;
};

ShapingOptions no_dead_zone(FilterKind filter) {
  ShapingOptions o;
  o.dead_zone.setZero();
  o.filter.kind = filter;
  return o;
}

int frames_in_motion(Shaping shaping, int frames, const Vector6& noise) {
  NoisySensor sensor(7);
  int moved = 0;
  for (int i = 0; i < frames; ++i) {
    Sample s = sensor.sample(Vector6::Zero(), noise);
    shaping.shape(s);
    moved += !s.deflection.isZero(0);
  }
  return moved;
}

TEST(ShapingRest, AnHourOfNoiseWithoutADeadZoneOfTheUsersIsExactlyZero) {
  constexpr int kHour = 3600 * 60;
  for (const FilterKind filter : kFilters)
    EXPECT_EQ(frames_in_motion(Shaping(no_dead_zone(filter)), kHour, kNoise), 0);
}

TEST(ShapingRest, ThreeSigmasWouldNotDo) {
  ShapingOptions o = no_dead_zone(FilterKind::none);
  o.noise_sigmas = 3;
  EXPECT_GT(frames_in_motion(Shaping(o), 3600, kNoise), 10);
}

TEST(ShapingRest, NoiseThatIsLargerThanStatedIsLearnt) {
  Shaping shaping(no_dead_zone(FilterKind::none));
  NoisySensor sensor(5);
  int moved = 0;
  for (int i = 0; i < 60 * 60; ++i) {
    Sample s = sensor.sample(Vector6::Zero(), 4 * kNoise);
    shaping.shape(s);
    if (i >= 10 * 60) moved += !s.deflection.isZero(0);
  }
  EXPECT_EQ(moved, 0) << "frames in motion after 10 s";
}

TEST(ShapingRest, TheCentreIsNotNumb) {
  // Twelve sigmas, 0.2 % of full scale in X and 0.3 % in Z, move.
  Shaping shaping(no_dead_zone(FilterKind::none));
  NoisySensor sensor(6);
  for (int i = 0; i < 600; ++i) {
    Sample s = sensor.sample(Vector6::Zero(), kNoise);
    shaping.shape(s);
  }
  Sample s = sensor.sample(12 * kNoise, kNoise);
  shaping.shape(s);
  EXPECT_TRUE((s.deflection.array() != 0).all()) << s.deflection.transpose();
}

TEST(ShapingRest, AMinuteOfATremblingHandDoesNotWidenIt) {
  Shaping shaping(no_dead_zone(FilterKind::none));
  NoisySensor sensor(6);
  const auto gentle = [&] {
    Sample s = sensor.sample(Vector6::Zero(), Vector6::Zero());
    s.wrench[0] = 11 * kNoise[0];
    shaping.shape(s);
    return s.deflection[0];
  };
  for (int i = 0; i < 600; ++i) {
    Sample s = sensor.sample(Vector6::Zero(), kNoise);
    shaping.shape(s);
  }
  ASSERT_GT(gentle(), 0);
  std::mt19937_64 random(1);
  std::normal_distribution<double> tremor(0, 0.02);  // N
  for (int i = 0; i < 3600; ++i) {
    Vector6 push = Vector6::Zero();
    push << 0.3 + tremor(random), tremor(random), tremor(random), 0, 0, 0;
    Sample s = sensor.sample(push, kNoise);
    shaping.shape(s);
  }
  for (int i = 0; i < 60; ++i) {  // until the swing is over
    Sample s = sensor.sample(Vector6::Zero(), kNoise);
    shaping.shape(s);
  }
  EXPECT_GT(gentle(), 0);
}

TEST(ShapingRest, RestIsLeftBeyondTheDeadZoneAndReachedBelowAPartOfIt) {
  ShapingOptions o = plain_shaping();
  Shaping shaping(o);
  int frame = 0;
  const auto at = [&](double newtons) {
    Sample s = pushed(0, newtons, std::chrono::milliseconds(16 * frame++));
    shaping.shape(s);
    return s.deflection[0];
  };
  EXPECT_EQ(at(0.08), 0) << "on the way out";
  EXPECT_GT(at(0.30), 0);
  EXPECT_GT(at(0.08), 0) << "on the way back";
  EXPECT_EQ(at(0.0699), 0);
  EXPECT_EQ(at(0.08), 0) << "out again";
}

TEST(ShapingRest, TheWayOutAndBackHasNoJump) {
  ShapingOptions o = plain_shaping();
  Shaping shaping(o);
  double last = 0;
  constexpr int kSteps = 4000;
  constexpr double kPeak = 1.2;                 // N
  constexpr double kStep = 2 * kPeak / kSteps;  // N a frame
  constexpr double kSteepest =
      (1 + 0.3) / (1 - 0.1);  // per N, where zero moves from outer to inner
  for (int i = 0; i <= kSteps; ++i) {
    const double newtons = kPeak - std::abs(kPeak - i * kStep);
    Sample s = pushed(0, newtons, std::chrono::milliseconds(4 * i));
    shaping.shape(s);
    EXPECT_LE(std::abs(s.deflection[0] - last), 1.02 * kStep * kSteepest) << newtons << " N";
    if (2 * i < kSteps) {
      EXPECT_GE(s.deflection[0], last) << newtons << " N, on the way out";
    }
    last = s.deflection[0];
  }
  EXPECT_EQ(last, 0);
}

TEST(ShapingRest, NoiseAtItsEdgeMovesByNoMoreThanItself) {
  ShapingOptions o = plain_shaping();
  Shaping shaping(o);
  std::mt19937_64 random(4);
  std::normal_distribution<double> noise(0, 0.001);  // N
  for (int i = 0; i < 5000; ++i) {
    Sample s = pushed(0, 0.1 + noise(random), std::chrono::milliseconds(16 * i));
    shaping.shape(s);
    EXPECT_LE(std::abs(s.deflection[0]), 0.008) << "of full scale: 4 to 5 sigmas of 0.001";
  }
}

/// Seconds from a moment on until motion is zero for good; the push ends then.
double stop_to_zero(FilterKind filter, const std::function<double(double)>& push, double end) {
  ShapingOptions o;
  o.filter.kind = filter;
  Shaping shaping(o);
  double moving_until = 0;
  for (int i = 0; i < 4 * 60; ++i) {
    const double t = i / kFps;
    Sample s = pushed(0, push(t), seconds_as_duration(t));
    shaping.shape(s);
    if (!s.deflection.isZero(0)) moving_until = t;
  }
  return std::max(0.0, moving_until + 1 / kFps - end);
}

TEST(ShapingRest, LettingGoStopsWithinAFrameWhateverTheFilter) {
  constexpr double kEnd = 1.0;  // s
  const auto let_go = [](double t) { return t < kEnd ? 0.6 : 0.0; };
  const auto led_back = [](double t) { return 0.6 * (1 - minimum_jerk((t - kEnd + 0.15) / 0.15)); };
  for (int i = 0; i < 3; ++i) {
    const double sudden = stop_to_zero(kFilters[i], let_go, kEnd);
    const double slow = stop_to_zero(kFilters[i], led_back, kEnd);
    std::printf("%s: zero %.0f ms after letting go, %.0f ms after leading back in 150 ms\n",
                kFilterNames[i], 1e3 * sudden, 1e3 * slow);
    EXPECT_LE(sudden, 1 / kFps + 1e-9);
    EXPECT_LE(slow, 1 / kFps + 1e-9);
  }
}

TEST(ShapingRest, ATapTheOtherWayRightAfterLettingGoNeverMovesTheOldWay) {
  for (const FilterKind filter : kFilters) {
    ShapingOptions o;
    o.filter.kind = filter;
    Shaping shaping(o);
    for (int i = 0; i < 120; ++i) {
      const double newtons = i < 60 ? 0.6 : i < 63 ? 0.0 : -0.3;
      Sample s = pushed(0, newtons, seconds_as_duration(i / kFps));
      shaping.shape(s);
      if (i >= 60) {
        EXPECT_LE(s.deflection[0], 0) << i;
      }
    }
  }
}

/// A push of `size` until 1 s, let go at once: then the platform swings, as the published one does.
double let_go(double t, double size) {
  constexpr double kHz = 26;
  constexpr double kDecay = 0.1;  // s
  const double since = t - 1;
  if (since < 0) return size;
  return size * std::exp(-since / kDecay) * std::cos(2 * std::numbers::pi * kHz * since);
}

/// Seconds of motion after a sudden release, at most, over all moments between two frames.
double motion_after_release(const ShapingOptions& options, double fps, double size) {
  double longest = 0;
  for (int phase = 0; phase < 20; ++phase) {
    Shaping shaping(options);
    for (int i = 0; i < 3 * fps; ++i) {
      const double t = (i + phase / 20.0) / fps;
      Sample s = pushed(0, let_go(t, size), seconds_as_duration(t));
      s.wrench[4] = 0.01 * s.wrench[0];  // it swings on another axis too
      shaping.shape(s);
      if (!s.deflection.isZero(0)) longest = std::max(longest, t - 1);
    }
  }
  return longest;
}

TEST(ShapingRest, TheSwingAfterASuddenReleaseIsNoMotion) {
  for (const double fps : {25.0, 30.0, 60.0, 120.0}) {
    for (const double size : {0.1, 0.3, 0.6, 2.0}) {
      ShapingOptions o;
      const double guarded = motion_after_release(o, fps, size);
      o.swing = 0;
      const double bare = motion_after_release(o, fps, size);
      std::printf("%.0f fps, %.1f N let go: motion for %.0f ms, as pushes %.0f ms\n", fps, size,
                  1e3 * guarded, 1e3 * bare);
      // At 25 frames a second a swing of 26 Hz looks like a hand that lets go slowly.
      if (fps < 60) continue;
      EXPECT_LE(guarded, 0.0125) << "until the swing has turned round";
      if (size >= 0.3) {
        EXPECT_GT(bare, 0.15);
      }
    }
  }
}

TEST(ShapingRest, NeitherIsThatAfterATapWhichWasSuppressed) {
  Shaping shaping{ShapingOptions{}};
  for (int i = 0; i < 120; ++i) {
    const double t = i / kFps;
    Sample s = pushed(0, t > 0.95 ? let_go(t, 0.6) : 0, seconds_as_duration(t));
    if (t < 1.05) {
      shaping.suppress(s);
    } else {
      shaping.shape(s);
    }
    EXPECT_EQ(s.deflection, Vector6::Zero().eval()) << t << " s";
  }
}

TEST(ShapingRest, WhatWasSuppressedDoesNotLinger) {
  ShapingOptions o;
  o.filter.kind = FilterKind::exponential;
  Shaping shaping(o);
  for (int i = 0; i < 90; ++i) {
    const double newtons = i < 60 ? 0.6 : i < 80 ? 0.0 : -0.3;
    Sample s = pushed(0, newtons, seconds_as_duration(i / kFps));
    if (i < 60) {
      shaping.suppress(s);
    } else {
      shaping.shape(s);
    }
    EXPECT_LE(s.deflection[0], 0) << i;
  }
}

TEST(ShapingRest, AHandThatTurnsRoundIsSoonFollowed) {
  for (const double fps : {25.0, 60.0}) {
    for (const double seconds : {0.15, 0.4}) {
      Shaping guarded{ShapingOptions{}};
      ShapingOptions o;
      o.swing = 0;
      Shaping bare{o};
      double late = 0;
      for (int i = 0; i < 2 * fps; ++i) {
        const double t = i / fps;
        Sample a = pushed(0, 0.5 - minimum_jerk((t - 0.5) / seconds), seconds_as_duration(t));
        Sample b = a;
        guarded.shape(a);
        bare.shape(b);
        if (a.deflection.isZero(0) && b.deflection[0] < 0) late += 1 / fps;
      }
      std::printf("%.0f fps, turned round within %.0f ms: %.0f ms late\n", fps, 1e3 * seconds,
                  1e3 * late);
      EXPECT_LE(late, 0.05);
    }
  }
}

}  // namespace
}  // namespace tagwrench
