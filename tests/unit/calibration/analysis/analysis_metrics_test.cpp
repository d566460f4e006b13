// Noise, creep, drift, hysteresis and cross-talk that are built into an instrument of numbers are
// measured.
#include <cmath>
#include <numbers>

#include "host/calibration/analysis/analysis.h"
#include "host/core/axis_names.h"
#include "tests/unit/calibration/analysis/analyzed.h"

namespace tagwrench::test {
namespace {

using study::Analysis;
using study::analyze;
using study::Trial;

TEST(AnalysisMetrics, NoiseDensityAndResolutionAreThoseOfTheReadings) {
  const Analysis a = analyze({steps(loads_in_turn(3), 2)}, {});
  const Eigen::Matrix<double, 6, 6> k = true_stiffness();
  Eigen::Matrix<double, 6, 1> sigma;
  sigma << 0.3e-6, 0.3e-6, 0.3e-6, 0.03e-3, 0.03e-3, 0.03e-3;
  for (Eigen::Index i = 0; i < 6; ++i) {
    const study::AxisReport& axis = a.axis[static_cast<std::size_t>(i)];
    const double expected = k.row(i).transpose().cwiseProduct(sigma).norm();
    ASSERT_TRUE(std::isfinite(axis.noise));
    EXPECT_NEAR(axis.noise, expected, 0.08 * expected);
    EXPECT_NEAR(axis.noise_density, expected * std::sqrt(2 / 50.0), 0.1 * expected);
    EXPECT_NEAR(axis.resolution, 2.77 * axis.noise, 0.01 * axis.noise);
  }
}

TEST(AnalysisMetrics, AWeightThatSwingsIsNoNoiseOfTheSensor) {
  const Eigen::MatrixXd loads = loads_in_turn(3);
  const Trial still = steps(loads, 4);
  Trial swinging = still;
  for (Eigen::Index i = 0; i < swinging.time.size(); ++i) {
    if (swinging.reference.row(i).norm() > 0)
      swinging.features(i, 0) +=
          3e-6 * std::sin(2 * std::numbers::pi * 1.5 * swinging.time[i]);  // m
  }
  const double alone = analyze({still}, {}).axis[0].noise;
  EXPECT_NEAR(analyze({swinging}, {}).axis[0].noise, alone, 0.15 * alone);
}

TEST(AnalysisMetrics, CreepAndDriftAreMeasured) {
  const double pause = 8;
  Trial trial = steps(loads_in_turn(2), pause);
  for (Eigen::Index i = 0; i < trial.time.size(); ++i) {
    // 2 % more of the displacement over each 8 s, and 10 um/h of the zero along x.
    const double since = std::fmod(trial.time[i] - trial.time[0], pause);
    trial.features.row(i) *= 1 + 0.02 * since / pause;
    trial.features(i, 0) += 10e-6 / 3600 * (trial.time[i] - trial.time[0]);
  }
  const Analysis a = analyze({trial}, {});
  for (std::size_t k = 0; k < 6; ++k) {
    ASSERT_TRUE(std::isfinite(a.axis[k].creep_percent));
    EXPECT_NEAR(a.axis[k].creep_percent, 2, 0.5) << kWrenchAxes[k];
  }
  ASSERT_TRUE(std::isfinite(a.axis[0].drift_per_hour));
  EXPECT_NEAR(a.axis[0].drift_per_hour, 10e-6 * 1120, 3e-3) << "N/h";
}

TEST(AnalysisMetrics, HysteresisAndNonLinearityAreMeasured) {
  LoadedPlatform platform;
  platform.lag = 0;
  platform.noise = 0.1;
  platform.reference_noise = 0.1;
  Trial trial = platform.trial();
  const Eigen::Matrix<double, 6, 6> compliance = true_stiffness().inverse();
  double play = 0;
  Eigen::MatrixXd seen = Eigen::MatrixXd::Zero(trial.time.size(), 6);
  for (Eigen::Index i = 0; i < trial.time.size(); ++i) {
    Eigen::Matrix<double, 6, 1> w = platform.load(trial.time[i]);
    // Play of +-0.02 N along x; along z 5 % softer at +-2 N than at 0.
    play = std::clamp(play, w[0] - 0.02, w[0] + 0.02);
    w[0] = play;
    w[2] += 0.025 * w[2] * w[2];
    trial.features.row(i) += (compliance * (w - platform.load(trial.time[i]))).transpose();
  }
  const Analysis a = analyze({trial}, {});
  EXPECT_NEAR(a.axis[0].hysteresis_percent, 100 * 0.04 / a.axis[0].full_scale, 0.8) << "% of range";
  EXPECT_LT(a.axis[1].hysteresis_percent, 0.6) << "% of range";
  EXPECT_GT(a.axis[2].nonlinearity_percent, 1.5) << "% of range";
  EXPECT_LT(a.axis[1].nonlinearity_percent, 0.5) << "% of range";
}

TEST(AnalysisMetrics, CrossTalkIsFoundWhereItWasLearnedAway) {
  // Two trials, in the second of which Fx shows in the reference's Fy with 4 %: each is held out
  // from the other.
  const Trial one = LoadedPlatform().trial();
  Trial other = one;
  other.name = "other";
  other.reference.col(1) += 0.04 * one.reference.col(0);
  const Analysis a = analyze({one, other}, {});
  ASSERT_EQ(a.folds.size(), 2U);
  EXPECT_EQ(a.validation, "each of 2 trials, predicted from the rest");
  // Once +4 %, once -4 %: the mean is none, the scores tell.
  EXPECT_NEAR(a.cross_talk(1, 0), 0, 0.5) << "% of range";
  EXPECT_GT(a.axis[1].rmse, 0.02) << "N";
  EXPECT_LT(a.axis[0].rmse, 0.01) << "N";
}

}  // namespace
}  // namespace tagwrench::test
