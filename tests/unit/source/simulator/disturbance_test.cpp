// What goes wrong in front of the lens looks as it should, is told as it is, and leaves everything
// else alone.
#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <numbers>
#include <set>
#include <vector>

#include "host/source/simulator/simulator_source.h"

namespace tagwrench::sim {
namespace {

constexpr int kWidth = 640;
constexpr int kHeight = 480;
constexpr double kFramePeriod_s = 0.04;
constexpr Occurrence kAlways{0, 1e6, 0};

using Pixels = std::vector<std::uint8_t>;

/// No noise, so that pictures compare exactly.
Scenario resting() {
  Scenario s;
  s.trajectory.motion = Motion::rest;
  s.noise = {0, 0};
  return s;
}

struct Shot {
  Pixels pixels;
  Truth truth;

  double mean(int left, int right, int top, int bottom) const {
    double sum = 0;
    for (int row = top; row < bottom; ++row) {
      for (int column = left; column < right; ++column) sum += at(column, row);
    }
    return sum / ((right - left) * (bottom - top));
  }
  double row_mean(int row) const { return mean(100, 540, row, row + 1); }
  int at(int column, int row) const {
    return pixels[static_cast<std::size_t>(row * kWidth + column)];
  }
};

Shot shoot(const Scenario& s, int number = 0) {
  SimulatorSource source(s, false);
  Frame frame;
  for (int i = 0; i <= number; ++i) source.read(frame);
  return {{frame.image.pixels, frame.image.pixels + kWidth * kHeight}, source.truth()};
}

TEST(Disturbances, WithoutAnyThePictureIsTheOneOfBeforeTheyExisted) {
  // Means over 160 x 120 pixels of frame 60 of the default scenario, grey levels.
  constexpr double kBefore[4][4] = {{157.2850, 94.3745, 87.6359, 35.7243},
                                    {151.7269, 103.3749, 93.3436, 75.8123},
                                    {89.8879, 93.4690, 72.6865, 72.5184},
                                    {36.1976, 78.4996, 79.8180, 35.2947}};
  const Shot shot = shoot(Scenario{}, 60);
  // The noise has other numbers since: five standard deviations of its mean over 19,200 pixels.
  constexpr double kTolerance_counts = 0.06;
  for (int v = 0; v < 4; ++v) {
    for (int u = 0; u < 4; ++u) {
      EXPECT_NEAR(shot.mean(u * 160, u * 160 + 160, v * 120, v * 120 + 120), kBefore[v][u],
                  kTolerance_counts);
    }
  }
}

Disturbances one_of_each(const Occurrence& when) {
  Disturbances d;
  d.occluders.resize(1);
  d.glare.resize(1);
  d.light.resize(1);
  d.flicker.resize(1);
  d.turning_light.resize(1);
  d.dirt.resize(1);
  d.focus.resize(1);
  d.occluders[0].when = d.glare[0].when = d.light[0].when = d.flicker[0].when = when;
  d.turning_light[0].when = d.dirt[0].when = d.focus[0].when = when;
  return d;
}

TEST(Disturbances, OfAnotherTimeChangeNoByte) {
  Scenario s;
  s.trajectory.rest_time = 0;
  const Shot plain = shoot(s, 10);
  s.disturbances = one_of_each({0.1, 0.1, 0});  // over by frame 6
  EXPECT_EQ(plain.pixels, shoot(s, 10).pixels);
  EXPECT_EQ(plain.truth.disturbances, 0U);
  EXPECT_NE(plain.pixels, shoot(s, 4).pixels);
}

TEST(Disturbances, TogetherLeaveTheTruthOfTheMotionAlone) {
  Scenario s;
  s.trajectory.rest_time = 0;
  const Truth plain = shoot(s, 10).truth;
  s.disturbances = one_of_each(kAlways);
  const Truth disturbed = shoot(s, 10).truth;
  EXPECT_EQ(plain.displacement, disturbed.displacement);
  EXPECT_EQ(plain.wrench, disturbed.wrench);
  EXPECT_EQ(std::popcount(disturbed.disturbances), 7);
}

TEST(Disturbances, ComeAgainAtTheirPeriod) {
  Scenario s = resting();
  s.disturbances.light = {{{0.19, 0.1, 0.4}, 0.5, 0}};  // frames 5..7, 15..17, 25..27
  SimulatorSource source(s, false);
  for (int i = 0; i < 30; ++i) {
    Frame frame;
    source.read(frame);
    const bool expected = i >= 5 && i % 10 >= 5 && i % 10 <= 7;
    EXPECT_EQ(source.truth().disturbances != 0, expected) << "frame " << i;
  }
}

TEST(Occluder, ABandIsWhereItIsSaidToBeAndHidesWhatItCovers) {
  Scenario s = resting();
  s.light = {200, 0, 0, 1, 0};
  s.optics.vignetting = 0;
  const Shot plain = shoot(s);
  Occluder o;
  o.when = {0, 2, 0};
  o.width_px = 60;
  o.softness_px = 0;
  o.speed_px_per_s = 500;
  o.aim_px = {-19.5, 0};
  o.reflectance = 0.4;
  o.texture = 0;
  s.disturbances.occluders = {o};
  // In the middle of its time, 1 s, its middle is at column 300; a frame later 20 px on.
  for (const int frame : {25, 26}) {
    const Shot shot = shoot(s, frame);
    const int middle = 300 + 20 * (frame - 25);
    constexpr int kEdge_px = 5;  // point spread and way during the exposure
    const double level = 0.4 * 200;
    for (int row = 0; row < kHeight; row += 40) {
      EXPECT_NEAR(shot.at(middle - 30 + kEdge_px, row), level, 1);
      EXPECT_NEAR(shot.at(middle + 30 - kEdge_px, row), level, 1);
    }
    EXPECT_EQ(shot.at(middle + 60, 20), plain.at(middle + 60, 20));
    for (const double visible : shot.truth.visible) {
      EXPECT_GT(visible, 0.4);
      EXPECT_LT(visible, 0.75);
    }
  }
}

TEST(Occluder, ADiscHidesItsAreaOfATag) {
  Scenario s = resting();
  Occluder o;
  o.when = kAlways;
  o.shape = OccluderShape::disc;
  o.width_px = 30;
  o.softness_px = 0;
  o.aim_px = {0, -60};  // on the upper tag
  s.disturbances.occluders = {o};
  const Shot shot = shoot(s);
  // 3.8 mm at 21 mm and 45 degrees: about 146 x 103 px.
  EXPECT_NEAR(1 - shot.truth.visible[0], std::numbers::pi * 15 * 15 / (146.0 * 103), 0.02);
  EXPECT_EQ(shot.truth.visible[1], 1);
  s.disturbances.occluders[0].width_px = 2000;
  EXPECT_EQ(shoot(s).truth.visible, (std::vector<double>{0, 0}));
}

TEST(ChangedLight, AStepScalesEveryGreyLevel) {
  Scenario s = resting();
  const Shot before = shoot(s);
  s.disturbances.light = {{kAlways, 0.6, 0}};
  const Shot dimmed = shoot(s);
  for (std::size_t i = 0; i < before.pixels.size(); i += 97) {
    if (before.pixels[i] == 255) continue;
    EXPECT_NEAR(dimmed.pixels[i], 0.6 * before.pixels[i], 1);
  }
  EXPECT_EQ(dimmed.truth.disturbances, bit(DisturbanceKind::light_step));
  EXPECT_EQ(dimmed.truth.visible, (std::vector<double>{1, 1}));
}

TEST(ChangedLight, ALensCapLeavesNothingToSee) {
  Scenario s = resting();
  s.disturbances.light = {{kAlways, 0, 0}};
  const Shot dark = shoot(s);
  EXPECT_EQ(*std::max_element(dark.pixels.begin(), dark.pixels.end()), 0);
  EXPECT_EQ(dark.truth.visible, (std::vector<double>{0, 0}));
  EXPECT_EQ(dark.truth.disturbances, bit(DisturbanceKind::darkness));
}

TEST(ChangedLight, ADriftIsSlow) {
  Scenario s = resting();
  s.disturbances.light = {{{0, 100, 0}, 0.8, 4.0}};
  const double whole = shoot(s, 0).row_mean(240);
  EXPECT_NEAR(shoot(s, 50).row_mean(240), 0.9 * whole, 0.01 * whole);  // half way after 2 s
  EXPECT_NEAR(shoot(s, 110).row_mean(240), 0.8 * whole, 0.01 * whole);
  EXPECT_EQ(shoot(s, 50).truth.disturbances, bit(DisturbanceKind::light_drift));
}

// 1 + depth sinc(f T) sin(2 pi f t), f = twice the mains' frequency.
double flicker_gain(double depth, double mains_hz, double exposure_s, double time_s) {
  const double turn = 2 * std::numbers::pi * 2 * mains_hz;
  const double half = 0.5 * turn * exposure_s;
  return 1 + depth * std::sin(half) / half * std::sin(turn * time_s);
}

TEST(FlickeringLight, IsAGainFromFrameToFrameWithAGlobalShutter) {
  Scenario s = resting();
  const Shot steady = shoot(s);
  s.disturbances.flicker = {{kAlways, 0.3, 60}};
  for (const int frame : {1, 2, 3}) {
    const Shot shot = shoot(s, frame);
    const double gain = flicker_gain(0.3, 60, s.exposure.time, frame * kFramePeriod_s);
    EXPECT_GT(std::abs(gain - 1), 0.03);
    for (const int row : {100, 400}) {
      EXPECT_NEAR(shot.row_mean(row) / steady.row_mean(row), gain, 0.01) << "frame " << frame;
    }
  }
}

TEST(FlickeringLight, IsBandsOverTheRowsWithARollingReadout) {
  Scenario s = resting();
  s.exposure.time = 2e-3;
  s.exposure.rolling_readout = 20e-3;
  const Shot steady = shoot(s);
  s.disturbances.flicker = {{kAlways, 0.3, 50}};
  const Shot shot = shoot(s, 5);
  for (int row = 20; row < kHeight; row += 20) {
    const double time = 5 * kFramePeriod_s + (row - 239.5) / kHeight * 20e-3;
    EXPECT_NEAR(shot.row_mean(row) / steady.row_mean(row), flicker_gain(0.3, 50, 2e-3, time), 0.015)
        << "row " << row;
  }
}

TEST(TurningLight, IsBrighterOnTheSideItComesFrom) {
  Scenario s = resting();
  const Shot steady = shoot(s);
  s.disturbances.turning_light = {{kAlways, 0.3, 4.0, 0}};
  const Shot right = shoot(s, 0);  // along +x
  const Shot down = shoot(s, 25);  // a quarter turn on, along +y
  constexpr double kHalfDiagonal_px = 400;
  const auto gain = [&](const Shot& shot, int column, int row) {
    return shot.mean(column - 5, column + 5, row - 5, row + 5) /
           steady.mean(column - 5, column + 5, row - 5, row + 5);
  };
  EXPECT_NEAR(gain(right, 520, 240), 1 + 0.3 * 200 / kHalfDiagonal_px, 0.02);
  EXPECT_NEAR(gain(right, 120, 240), 1 - 0.3 * 200 / kHalfDiagonal_px, 0.02);
  EXPECT_NEAR(gain(down, 320, 400), 1 + 0.3 * 160 / kHalfDiagonal_px, 0.02);
  EXPECT_NEAR(gain(down, 520, 240), 1, 0.02);
}

TEST(Glare, SaturatesItsSpotAndNothingFarAway) {
  Scenario s = resting();
  const Shot plain = shoot(s);
  Glare g;
  g.when = kAlways;
  g.aim_px = {0.5, 60.5};
  g.wander_px = 0;
  g.fade = 0;
  s.disturbances.glare = {g};
  const Shot shot = shoot(s);
  EXPECT_EQ(shot.at(320, 300), 255);
  EXPECT_NEAR(shot.at(320 + 60, 300) - plain.at(320 + 60, 300), 400 * std::exp(-2.0), 2);
  EXPECT_EQ(shot.at(320 + 160, 300), plain.at(320 + 160, 300));
  EXPECT_EQ(shot.truth.visible[0], 1);
  EXPECT_LT(shot.truth.visible[1], 0.95);
}

TEST(Dirt, ChangesTheTagItIsOnAndNothingElse) {
  Scenario s = resting();
  const Shot plain = shoot(s);
  s.disturbances.dirt = {{kAlways, 1, 6, 2, 0.4e-3, 0.4}};
  const Shot shot = shoot(s);
  int changed = 0;
  for (int row = 0; row < kHeight; ++row) {
    for (int column = 0; column < kWidth; ++column) {
      if (std::abs(shot.at(column, row) - plain.at(column, row)) < 10) continue;
      ++changed;
      EXPECT_GT(row, 230) << "above the lower tag";
      EXPECT_NEAR(column, 320, 90);
    }
  }
  EXPECT_GT(changed, 100);
  EXPECT_LT(changed, 5000);
  EXPECT_EQ(shot.truth.visible, (std::vector<double>{1, 1}));
}

TEST(LostFocus, SoftensEdgesWhileItLasts) {
  const auto steepest = [](const Shot& shot) {
    int most = 0;
    for (int row = 150; row < 330; ++row) {
      for (int column = 250; column < 390; ++column)
        most = std::max(most, std::abs(shot.at(column + 1, row) - shot.at(column, row)));
    }
    return most;
  };
  Scenario s = resting();
  s.disturbances.focus = {{{0.4, 0.4, 0}, 6e-3, 0.1, 0}};
  const int before = steepest(shoot(s, 5));
  EXPECT_LT(steepest(shoot(s, 15)), 0.6 * before);
  EXPECT_EQ(steepest(shoot(s, 25)), before);
}

TEST(LostFrames, JumpInTheSequenceAreCountedAndLeaveTheOthersAsTheyWere) {
  Scenario s;
  const Scenario whole = s;
  s.disturbances.lost_frames = {0.1, 3};
  SimulatorSource source(s, false), all(whole, false);
  std::uint64_t expected = 0, lost = 0;
  std::set<std::uint32_t> gaps;
  Frame frame, same;
  constexpr int kFrames = 60;
  for (int i = 0; i < kFrames; ++i) {
    ASSERT_EQ(source.read(frame), ReadStatus::frame);
    EXPECT_EQ(frame.sequence, expected + frame.dropped);
    expected = frame.sequence + 1;
    lost += frame.dropped;
    gaps.insert(frame.dropped);
    do {
      all.read(same);
    } while (same.sequence < frame.sequence);
    ASSERT_EQ(same.capture_time, frame.capture_time);
    ASSERT_TRUE(
        std::equal(frame.image.pixels, frame.image.pixels + kWidth * kHeight, same.image.pixels));
  }
  // Gaps begin at a tenth of all frames and have two on average.
  EXPECT_NEAR(static_cast<double>(lost) / static_cast<double>(expected), 0.18, 0.1);
  EXPECT_EQ(gaps.count(0), 1U);
}

TEST(RandomDisturbances, ShowEveryKindWithinOneRoundAndLeaveQuietBetween) {
  Disturbances d;
  d.random = {1.0, 2.0};
  const DisturbancePlayer player(d, 5, kWidth, 2);
  std::uint32_t kinds = 0;
  constexpr int kRound = 12;
  for (int i = 0; i < (1 + 2 * kRound) * 100; ++i) {
    const double time = 0.01 * i;
    const std::uint32_t now = player.between(time, time).kinds;
    kinds |= now;
    const double phase = std::fmod(time - 1.0, 2.0) / 2.0;
    if (time < 1.0 || phase > 0.76) {
      EXPECT_EQ(now, 0U) << "at " << time << " s";
    }
  }
  EXPECT_EQ(std::popcount(kinds), kDisturbanceKinds - 1);  // a drift is not drawn at random
}

TEST(RandomDisturbances, DependOnTheSeed) {
  Disturbances d;
  d.random = {0.0, 2.0};
  const DisturbancePlayer one(d, 1, kWidth, 2), again(d, 1, kWidth, 2), two(d, 2, kWidth, 2);
  int different = 0;
  for (double time = 0; time < 60; time += 0.02) {
    const std::uint32_t now = one.between(time, time).kinds;
    ASSERT_EQ(now, again.between(time, time).kinds);
    different += now != two.between(time, time).kinds ? 1 : 0;
  }
  EXPECT_GT(different, 500);
}

TEST(HardMotion, HoldsTapsAndDropsWithinWhatATrackerCanFollow) {
  Scenario s;
  s.trajectory.motion = Motion::hard;
  s.trajectory.amplitude = {0.25, 0.25, 1.4, 0.006, 0.006, 0.003};
  const TrajectoryPlayer player(s.trajectory, 3);
  EXPECT_EQ(player.applied_wrench(1.4), Vector6::Zero());
  PlatformMotion motion(s.mechanics, player, 0, 0.01);
  std::vector<double> steps;
  bool falls = false;
  Vector6 last = Vector6::Zero();
  for (int i = 0; i < 1500; ++i) {
    const double time = i * kFramePeriod_s;
    motion.advance_to(time);
    const Vector6 now = motion.at(time).displacement;
    steps.push_back((now - last).head<3>().norm());
    last = now;
    falls = falls || player.base_acceleration(time).z() < -9;
    EXPECT_LT(now.head<3>().norm(), 2.5e-3);
  }
  std::sort(steps.begin(), steps.end());
  EXPECT_LT(steps[750], 0.1e-3);   // m between frames: mostly quiet ...
  EXPECT_GT(steps[1490], 0.4e-3);  // ... and at times a leap
  EXPECT_LT(steps.back(), 2.0e-3);
  EXPECT_TRUE(falls);
}

TEST(EvenExposure, IsTheMeanOfThePicturesOfItsInstants) {
  Scenario s;
  s.noise = {0, 0};
  s.trajectory.motion = Motion::tap;
  s.trajectory.axis = 1;
  s.trajectory.rest_time = 0;
  s.trajectory.share = 0.4;
  constexpr double kTime_s = 0.012;  // the platform rings, tags go about 3 px during the exposure
  const TrajectoryPlayer player(s.trajectory, s.seed);
  PlatformMotion motion(s.mechanics, player, -0.1, 0.01);
  motion.advance_to(kTime_s + s.exposure.time);
  const auto render = [&](Renderer& renderer, double time) {
    Pixels pixels(kWidth * kHeight);
    renderer.render(motion, time, 0, pixels.data());
    return pixels;
  };
  Scenario still = s;
  still.exposure.time = 0;
  Renderer instant(still);
  std::vector<double> mean(kWidth * kHeight);
  constexpr int kInstants = 16;
  for (int i = 0; i < kInstants; ++i) {
    const double share = (i + 0.5) / kInstants - 0.5;
    const Pixels pixels = render(instant, kTime_s + share * s.exposure.time);
    for (std::size_t p = 0; p < mean.size(); ++p) mean[p] += pixels[p] / double{kInstants};
  }
  const auto rms = [&](const Pixels& pixels) {
    double squares = 0;
    for (int row = 130; row < 350; ++row) {
      for (int column = 250; column < 390; ++column) {
        const auto p = static_cast<std::size_t>(row * kWidth + column);
        squares += std::pow(pixels[p] - mean[p], 2);
      }
    }
    return std::sqrt(squares / (220 * 140));
  };
  Renderer quick(s);
  const double uneven = rms(render(quick, kTime_s));
  EXPECT_GT(quick.smear_px(), 1);
  s.exposure.even = true;
  Renderer thorough(s);
  const double even = rms(render(thorough, kTime_s));
  EXPECT_LT(even, 0.6);  // grey levels; rounding alone makes 0.4
  EXPECT_GT(uneven, 2 * even);
}

}  // namespace
}  // namespace tagwrench::sim
