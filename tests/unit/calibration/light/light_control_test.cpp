// The brightness loop against a camera of its own: light adds up, a sensor clips at 255.
#include <gtest/gtest.h>

#include <algorithm>

#include "host/calibration/light/control.h"

namespace tagwrench {
namespace {

using State = LightControl::State;

struct Bench {
  double led_counts_per_us_permille = 1e-4;  ///< at gain 1
  double ambient_counts_per_us = 0;

  LightReading picture(const LightSetting& s) const {
    const double light = s.exposure_us * s.gain *
                         (s.led_permille * led_counts_per_us_permille + ambient_counts_per_us);
    return {std::min(255.0, light), light > 255 ? 0.3 : 0.0};
  }

  /// State at the end and the number of pictures that it took.
  std::pair<State, int> run(LightControl& control) const {
    for (int pictures = 1; pictures <= 30; ++pictures) {
      const State state = control.take(picture(control.setting()));
      if (state != State::settling) return {state, pictures};
    }
    return {State::settling, 30};
  }
};

constexpr LightLimits kLimits{.exposure_us = {100, 30000},
                              .led_permille = {10, 300},
                              .gain = {1, 16},
                              .short_exposure_us = 4000};

TEST(LightControl, BringsTheWhiteToItsLevelWithAShortExposureAndWithoutGain) {
  LightControl control(kLimits);
  Bench bench{.led_counts_per_us_permille = 190.0 / (4000 * 120)};
  const auto [state, pictures] = bench.run(control);
  EXPECT_EQ(state, State::settled);
  EXPECT_LE(pictures, 4);
  EXPECT_NEAR(bench.picture(control.setting()).white_counts, LightControl::kTarget_counts,
              LightControl::kTolerance_counts);
  EXPECT_DOUBLE_EQ(control.setting().exposure_us, 4000);
  EXPECT_DOUBLE_EQ(control.setting().gain, 1);
}

TEST(LightControl, TakesGainOnlyWhenTheLedIsAtItsEndAndALongExposureOnlyAfterThat) {
  LightControl dim(kLimits);
  Bench bench{.led_counts_per_us_permille = 190.0 / (4000 * 300 * 6.0)};
  EXPECT_EQ(bench.run(dim).first, State::settled);
  EXPECT_DOUBLE_EQ(dim.setting().exposure_us, 4000);
  EXPECT_DOUBLE_EQ(dim.setting().led_permille, 300);
  EXPECT_NEAR(dim.setting().gain, 6, 0.5);

  LightControl dimmer(kLimits);
  bench.led_counts_per_us_permille = 190.0 / (4000 * 300 * 16 * 3.0);
  EXPECT_EQ(bench.run(dimmer).first, State::settled);
  EXPECT_DOUBLE_EQ(dimmer.setting().gain, 16);
  EXPECT_NEAR(dimmer.setting().exposure_us, 12000, 1000);
}

TEST(LightControl, LeavesAClippedPictureAtOnceWhateverItsLevelSeems) {
  LightControl control(kLimits);
  const LightSetting before = control.setting();
  EXPECT_EQ(control.take({190, 0.05}), State::settling) << "the level fits, but pixels clip";
  EXPECT_LT(control.setting().led_permille, 0.6 * before.led_permille);
}

TEST(LightControl, NeverSettlesOnAClippedPicture) {
  for (double strength : {1.0, 10.0, 100.0, 1000.0}) {
    LightControl control(kLimits);
    Bench bench{.led_counts_per_us_permille = strength * 190.0 / (4000 * 120)};
    const State state = bench.run(control).first;
    const LightReading last = bench.picture(control.setting());
    EXPECT_EQ(state == State::settled, last.white_counts < LightControl::kClipped_counts)
        << strength;
  }
}

TEST(LightControl, SaysTooDarkWhenEverythingIsAtItsUpperEnd) {
  LightControl control(kLimits);
  EXPECT_EQ((Bench{.led_counts_per_us_permille = 1e-9}.run(control).first), State::too_dark);
  EXPECT_DOUBLE_EQ(control.setting().exposure_us, 30000);
  EXPECT_DOUBLE_EQ(control.setting().led_permille, 300);
  EXPECT_DOUBLE_EQ(control.setting().gain, 16);
}

TEST(LightControl, AmbientLightShortensTheExposureAndWhatIsTooMuchIsSaid) {
  LightControl sunny(kLimits);
  Bench bench{.led_counts_per_us_permille = 190.0 / (4000 * 120),
              .ambient_counts_per_us = 0.2};  // 800 counts at 4 ms
  EXPECT_EQ(bench.run(sunny).first, State::settled);
  EXPECT_LT(sunny.setting().exposure_us, 1000);

  LightControl blinded(kLimits);
  bench.ambient_counts_per_us = 10;
  EXPECT_EQ(bench.run(blinded).first, State::too_bright);
  EXPECT_DOUBLE_EQ(blinded.setting().exposure_us, 100);
}

TEST(LightControl, ACameraThatCannotBeSetLeavesItToTheLed) {
  LightLimits fixed = kLimits;
  fixed.exposure_us = {10000, 10000};
  fixed.gain = {1, 1};
  LightControl control(fixed);
  Bench bench{.led_counts_per_us_permille = 190.0 / (10000 * 40)};
  EXPECT_EQ(bench.run(control).first, State::settled);
  EXPECT_DOUBLE_EQ(control.setting().exposure_us, 10000);
  EXPECT_NEAR(control.setting().led_permille, 40, 4);
}

}  // namespace
}  // namespace tagwrench
