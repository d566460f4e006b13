// One lag for all axes, and how well it is known.
#include "host/calibration/analysis/lag.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdio>

#include "tests/unit/calibration/analysis/loaded_platform.h"

namespace tagwrench::test {
namespace {

using study::estimate_lag;
using study::Lag;
using study::Segment;

Segment segment_of(const study::Trial& trial) {
  return {trial.time, trial.features, trial.reference_time, trial.reference};
}

Lag lag_of(const LoadedPlatform& platform) {
  const Segment segment = segment_of(platform.trial());
  return estimate_lag({&segment, 1});
}

TEST(Lag, OfEitherSignIsFoundToAFractionOfAMillisecond) {
  for (const double lag : {-0.15, -0.0031, 0.0, 0.0427, 0.3}) {
    LoadedPlatform platform;
    platform.lag = lag;
    const Lag found = lag_of(platform);
    EXPECT_TRUE(found.known);
    EXPECT_FALSE(found.at_limit);
    EXPECT_NEAR(found.value, lag, 0.5e-3) << "s";
    EXPECT_LT(found.sigma, 0.5e-3) << "s";
    EXPECT_GT(found.explained, 0.99);
  }
}

TEST(Lag, ErrorsAreAsLargeAsItsSigmaSays) {
  double squares = 0;
  constexpr int kSeeds = 40;
  for (unsigned seed = 1; seed <= kSeeds; ++seed) {
    LoadedPlatform platform;
    platform.seconds = 8;
    platform.reading_rate = 25;
    platform.noise = 20;
    platform.seed = seed;
    const Lag found = lag_of(platform);
    ASSERT_TRUE(found.known);
    squares += std::pow((found.value - platform.lag) / found.sigma, 2);
  }
  const double normalised = std::sqrt(squares / kSeeds);
  std::printf("error over sigma, rms: %.2f\n", normalised);
  EXPECT_GT(normalised, 0.6);
  EXPECT_LT(normalised, 1.5);
}

TEST(Lag, IsNotDrawnToWhereInterpolationHalvesTheReferencesNoise) {
  // Clocks in step: every reading falls 0.5 ms beside a sample of the reference at the true lag,
  // and midway between two of them at 4.5 ms more.
  double sum = 0;
  constexpr int kSeeds = 20;
  for (unsigned seed = 1; seed <= kSeeds; ++seed) {
    LoadedPlatform platform;
    platform.reading_rate = 25;
    platform.lag = -0.0395;
    platform.reference_noise = 5;
    platform.seed = seed;
    sum += lag_of(platform).value - platform.lag;
  }
  EXPECT_NEAR(sum / kSeeds, 0, 0.5e-3) << "s, mean error";
}

TEST(Lag, AxesThatNeverChangeDoNotCount) {
  LoadedPlatform platform;
  study::Trial trial = platform.trial();
  trial.reference.rightCols(4).setConstant(0.25);
  trial.features.col(5).setConstant(1e-3);
  const Segment segment = segment_of(trial);
  const Lag found = estimate_lag({&segment, 1});
  EXPECT_TRUE(found.known);
  EXPECT_NEAR(found.value, platform.lag, 1e-3) << "s";
}

TEST(Lag, PushesInSeveralDirectionsShareIt) {
  std::array<Segment, 3> pushes;
  for (int i = 0; i < 3; ++i) {
    LoadedPlatform platform;
    platform.seconds = 5;
    platform.start = 10 * i;
    platform.amplitude.setZero();
    platform.amplitude[i] = 1.5;
    platform.bias[i] = 1.6;
    const study::Trial trial = platform.trial();
    auto& push = pushes[static_cast<std::size_t>(i)];
    push = segment_of(trial);
    push.reference = trial.reference.col(i);
    push.model = i;
  }
  const Lag found = estimate_lag(pushes);
  EXPECT_TRUE(found.known);
  EXPECT_NEAR(found.value, 0.040, 1e-3) << "s";
}

TEST(Lag, OfSignalsThatHaveNothingInCommonIsNotKnown) {
  LoadedPlatform platform;
  Segment segment = segment_of(platform.trial());
  std::mt19937 random(7);
  std::normal_distribution<double> normal;
  for (double& v : segment.reference.reshaped()) v = normal(random);
  const Lag found = estimate_lag({&segment, 1});
  EXPECT_FALSE(found.known);
  EXPECT_EQ(found.value, 0);
  EXPECT_NE(study::lag_warning(found), "");
}

TEST(Lag, BeyondWhatIsSearchedIsSaidToBeAtTheLimit) {
  LoadedPlatform platform;
  platform.lag = 0.56;
  const Lag found = lag_of(platform);
  EXPECT_TRUE(found.at_limit);
  EXPECT_NE(study::lag_warning(found).find("end of what was searched"), std::string::npos);
}

TEST(Lag, OutsideOfWhatIsUsualIsWarnedAbout) {
  Lag lag;
  lag.known = true;
  lag.sigma = 1e-3;
  lag.value = 0.040;
  EXPECT_EQ(study::lag_warning(lag), "");
  lag.value = -0.040;
  EXPECT_EQ(study::lag_warning(lag), "");
  EXPECT_EQ(study::lag_text(lag), "the reference comes 40.0 +- 1.0 ms after the readings");
  lag.value = -0.350;
  EXPECT_EQ(study::lag_warning(lag).rfind(
                "the reference comes 350.0 +- 1.0 ms after the readings, more than 200 ms", 0),
            0U);
  lag.value = 0.350;
  EXPECT_EQ(study::lag_warning(lag).rfind(
                "the readings come 350.0 +- 1.0 ms after the reference, more than 200 ms", 0),
            0U);
}

TEST(Lag, NothingToEstimateFromIsNotKnown) {
  EXPECT_FALSE(estimate_lag({}).known);
  Segment segment = segment_of(LoadedPlatform().trial());
  segment.time.array() += 1000;
  EXPECT_FALSE(estimate_lag({&segment, 1}).known);
}

TEST(ReferenceAt, InterpolatesButNeverAcrossGapsNorBeyondTheEnds) {
  const Eigen::VectorXd at{{0, 1, 2, 5, 6}};
  const Eigen::MatrixXd values = at * 10;
  const Eigen::VectorXd asked{{-0.5, 0, 1.25, 3, 6, 6.5}};
  const Eigen::MatrixXd found = study::reference_at(asked, 0, at, values, 2);
  EXPECT_TRUE(std::isnan(found(0, 0)));
  EXPECT_EQ(found(1, 0), 0);
  EXPECT_DOUBLE_EQ(found(2, 0), 12.5);
  EXPECT_TRUE(std::isnan(found(3, 0))) << "the gap from 2 to 5 s";
  EXPECT_EQ(found(4, 0), 60);
  EXPECT_TRUE(std::isnan(found(5, 0)));
  EXPECT_DOUBLE_EQ(study::reference_at(asked, 0.5, at, values, 2)(2, 0), 7.5);
}

}  // namespace
}  // namespace tagwrench::test
