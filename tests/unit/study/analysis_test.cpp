// What is built into an instrument of numbers is what its analysis says, and what is wrong with its
// data is said too.
#include "host/study/analysis.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <numeric>

#include "host/config_error.h"
#include "host/study/analysis_report.h"
#include "host/study/analysis_warnings.h"
#include "tests/unit/study/loaded_platform.h"

namespace tagwrench::test {
namespace {

using study::Analysis;
using study::AnalysisOptions;
using study::analyze;
using study::Trial;

bool warns(const Analysis& analysis, const std::string& part) {
  for (const std::string& warning : analysis.warnings) {
    if (warning.find(part) != std::string::npos) return true;
  }
  return false;
}

std::string all_warnings(const Analysis& analysis) {
  return std::accumulate(analysis.warnings.begin(), analysis.warnings.end(), std::string(),
                         [](const std::string& a, const std::string& b) { return a + "\n" + b; });
}

#define EXPECT_WARNS(analysis, part) EXPECT_TRUE(warns(analysis, part)) << all_warnings(analysis)

std::string complaint(const std::vector<Trial>& trials, const AnalysisOptions& options = {}) {
  try {
    analyze(trials, options);
  } catch (const ConfigError& e) {
    return e.what();
  }
  return "no complaint";
}

/// The platform at rest for `pause` s, then loaded by one step of `load` for as long, and so on, a
/// reference without noise.
Trial steps(const Eigen::MatrixXd& loads, double pause, double rate = 50) {
  LoadedPlatform platform;
  platform.seconds = pause * static_cast<double>(loads.rows());
  platform.reading_rate = rate;
  platform.reference_rate = rate;
  platform.lag = 0;
  platform.amplitude.setZero();
  platform.reference_noise = 0;
  Trial trial = platform.trial();
  const Eigen::Matrix<double, 6, 6> compliance = true_stiffness().inverse();
  for (Eigen::Index i = 0; i < trial.time.size(); ++i) {
    const auto row = std::min(loads.rows() - 1,
                              static_cast<Eigen::Index>(static_cast<double>(i) / (pause * rate)));
    trial.reference.row(i) = loads.row(row);
    trial.features.row(i) += (compliance * loads.row(row).transpose()).transpose();
  }
  return trial;
}

/// Rest and full load of either sign on each axis in turn, over and over.
Eigen::MatrixXd loads_in_turn(int rounds) {
  const Eigen::Matrix<double, 6, 1> full{1, 1, 2, 0.02, 0.02, 0.015};
  Eigen::MatrixXd loads = Eigen::MatrixXd::Zero(24 * rounds, 6);
  for (int r = 0; r < rounds; ++r) {
    for (int k = 0; k < 6; ++k) {
      loads(24 * r + 4 * k + 1, k) = full[k];
      loads(24 * r + 4 * k + 3, k) = -full[k];
    }
  }
  return loads;
}

Eigen::MatrixXd predicted_between(const Analysis& analysis, double from, double to) {
  std::vector<Eigen::Index> rows;
  for (Eigen::Index i = 0; i < analysis.time.size(); ++i) {
    if (analysis.time[i] >= from && analysis.time[i] <= to) rows.push_back(i);
  }
  return analysis.predicted(rows, Eigen::all);
}

TEST(Analysis, RecoversTheStiffnessAndScoresItOnWhatItHasNotSeen) {
  const Analysis a = analyze({LoadedPlatform().trial()}, {});
  EXPECT_NEAR(a.lag.value, 0.040, 0.5e-3) << "s";
  EXPECT_EQ(a.folds.size(), 5U);
  const Eigen::Matrix<double, 6, 6> k = true_stiffness();
  for (Eigen::Index i = 0; i < 6; ++i) {
    EXPECT_NEAR(a.matrix(i, i), k(i, i), 0.01 * k(i, i)) << study::kAxisNames[i];
    const study::AxisReport& axis = a.axis[static_cast<std::size_t>(i)];
    EXPECT_TRUE(axis.calibrated) << axis.reason;
    EXPECT_GT(axis.r2, 0.998);
    EXPECT_LE(axis.r2, axis.r2_in_sample);
    EXPECT_GT(*axis.coverage, 0.92);
    EXPECT_LT(*axis.coverage, 0.98);
    for (const study::Fold& fold : a.folds) EXPECT_GT(fold.r2[static_cast<std::size_t>(i)], 0.99);
  }
  for (const study::Fold& fold : a.folds) EXPECT_NEAR(fold.lag.value, 0.040, 1e-3) << "s";
  EXPECT_EQ(all_warnings(a), "");
}

TEST(Analysis, AnAxisThatWasNeverOrHardlyLoadedIsNotCalibrated) {
  LoadedPlatform platform;
  platform.amplitude[4] = 0;
  platform.amplitude[5] = 0.5e-3;  // N m, of 0.15 mN m of noise
  Trial trial = platform.trial();
  trial.reference.col(4).setZero();
  const Analysis a = analyze({trial}, {});
  EXPECT_FALSE(a.axis[4].calibrated);
  EXPECT_NE(a.axis[4].reason.find("never loaded"), std::string::npos);
  EXPECT_FALSE(a.axis[5].calibrated);
  EXPECT_NE(a.axis[5].reason.find("hardly loaded"), std::string::npos);
  EXPECT_TRUE(a.axis[0].calibrated);
  EXPECT_WARNS(a, "Mz: not calibrated");
  EXPECT_NE(study::analysis_text(a).find("not calibrated"), std::string::npos);
}

TEST(Analysis, AnAxisThatWasOnlyLoadedTogetherWithAnotherIsNotCalibrated) {
  LoadedPlatform platform;
  Trial trial = platform.trial();
  // A force along y always 20 mm off the origin: Mx is told by Fy.
  trial.reference.col(3) = -0.02 * trial.reference.col(1);
  const Analysis a = analyze({trial}, {});
  EXPECT_FALSE(a.axis[3].calibrated);
  EXPECT_NE(a.axis[3].reason.find("never loaded by itself"), std::string::npos);
  EXPECT_WARNS(a, "the combination");
  EXPECT_TRUE(std::isnan(a.cross_talk(0, 3))) << "what Mx does alone cannot be told";
}

TEST(Analysis, ABacklogAtTheStartIsLeftOut) {
  Trial trial = LoadedPlatform().trial();
  // 2 s of readings of the reference that queued up and were stamped when they were read.
  for (Eigen::Index i = 0; i < 200; ++i)
    trial.reference_time[i] = trial.reference_time[199] - 1e-4 * static_cast<double>(199 - i);
  const Analysis a = analyze({trial}, {});
  EXPECT_WARNS(a, "the first 199 rows of the reference are stamped within 20 ms");
  EXPECT_GT(a.axis[0].r2, 0.998);
  AnalysisOptions kept;
  kept.drop_backlog = false;
  EXPECT_FALSE(warns(analyze({trial}, kept), "backlog"));
}

TEST(Analysis, ClocksThatRunApartAreNoticed) {
  LoadedPlatform platform;
  platform.seconds = 60;
  platform.lag_drift = 500e-6;
  EXPECT_WARNS(analyze({platform.trial()}, {}), "the two clocks run apart");
}

TEST(Analysis, ChannelsFilteredDifferentlyAreNoticed) {
  Trial trial = LoadedPlatform().trial();
  for (Eigen::Index i = 1; i < trial.time.size(); ++i)
    trial.features.row(i).tail(3) =
        0.4 * trial.features.row(i).tail(3) + 0.6 * trial.features.row(i - 1).tail(3);
  EXPECT_WARNS(analyze({trial}, {}), "by itself each axis lags differently");
}

TEST(Analysis, AReferenceOfTheWrongSignIsNoticed) {
  Trial trial = LoadedPlatform().trial();
  trial.reference = -trial.reference;
  EXPECT_WARNS(analyze({trial}, {}), "is the reference's sign reversed?");
}

TEST(Analysis, AReferenceAtItsLimitIsNoticed) {
  Trial trial = LoadedPlatform().trial();
  trial.reference.col(2) = trial.reference.col(2).cwiseMin(0.8);
  EXPECT_WARNS(analyze({trial}, {}), "the reference's Fz stays at its most of 0.8 N");
}

TEST(Analysis, GapsRepeatsConstantColumnsAndCoarseStepsAreSaid) {
  Trial trial = LoadedPlatform().trial();
  trial.features.col(2).setConstant(1e-3);
  for (Eigen::Index i = 400; i < 440; ++i) trial.features.row(i) = trial.features.row(399);
  trial.time.tail(500).array() += 0.5;
  trial.reference_time.tail(1000).array() += 0.5;
  trial.reference.col(5) = (trial.reference.col(5) / 1e-3).array().round() * 1e-3;
  const Analysis a = analyze({trial}, {});
  EXPECT_WARNS(a, "1 gap in the readings, the longest 0.52 s");
  EXPECT_WARNS(a, "1 gap in the reference");
  EXPECT_WARNS(a, "z_m never changes");
  EXPECT_WARNS(a, "40 of 1000 readings repeat the one before");
  EXPECT_WARNS(a, "Mz: the reference counts in steps of 0.001 N m");
}

TEST(Analysis, LoadsOfOneSignAreSaidToBeThat) {
  LoadedPlatform platform;
  platform.bias[2] = 2.2;
  EXPECT_WARNS(analyze({platform.trial()}, {}), "Fz: loaded one way only");
}

TEST(Analysis, NoiseDensityAndResolutionAreThoseOfTheReadings) {
  const Analysis a = analyze({steps(loads_in_turn(3), 2)}, {});
  const Eigen::Matrix<double, 6, 6> k = true_stiffness();
  Eigen::Matrix<double, 6, 1> sigma;
  sigma << 0.3e-6, 0.3e-6, 0.3e-6, 0.03e-3, 0.03e-3, 0.03e-3;
  for (Eigen::Index i = 0; i < 6; ++i) {
    const study::AxisReport& axis = a.axis[static_cast<std::size_t>(i)];
    const double expected = k.row(i).transpose().cwiseProduct(sigma).norm();
    ASSERT_TRUE(axis.noise && axis.noise_density && axis.resolution);
    EXPECT_NEAR(*axis.noise, expected, 0.08 * expected);
    EXPECT_NEAR(*axis.noise_density, expected * std::sqrt(2 / 50.0), 0.1 * expected);
    EXPECT_NEAR(*axis.resolution, 2.77 * *axis.noise, 0.01 * *axis.noise);
  }
}

TEST(Analysis, CreepAndDriftAreMeasured) {
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
    ASSERT_TRUE(a.axis[k].creep_percent.has_value());
    EXPECT_NEAR(*a.axis[k].creep_percent, 2, 0.5) << study::kAxisNames[k];
  }
  ASSERT_TRUE(a.axis[0].drift_per_hour.has_value());
  EXPECT_NEAR(*a.axis[0].drift_per_hour, 10e-6 * 1120, 3e-3) << "N/h";
}

TEST(Analysis, HysteresisAndNonLinearityAreMeasured) {
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

TEST(Analysis, CrossTalkIsFoundWhereItWasLearnedAway) {
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

TEST(Analysis, StepsOfAPlanAreHeldOutAsAWhole) {
  Trial trial = steps(loads_in_turn(1), 1);
  trial.held = true;
  trial.step.resize(trial.time.size());
  for (Eigen::Index i = 0; i < trial.time.size(); ++i) {
    // The first tenth of each is still settling.
    trial.step[i] = i % 50 < 5 ? -1 : static_cast<int>(i / 50);
  }
  const Analysis a = analyze({trial}, {});
  EXPECT_EQ(a.validation, "each of 24 steps, predicted from the rest");
  EXPECT_EQ(a.readings, 24U * 45U);
  EXPECT_EQ(a.lag.value, 0);
  EXPECT_EQ(a.reference_rate, 0);
  for (const study::AxisReport& axis : a.axis) EXPECT_GT(axis.r2, 0.99);
}

TEST(Analysis, PredictionsThatACalibrationBringsAreScoredAsTheyAre) {
  Trial trial = steps(loads_in_turn(1), 1);
  trial.held = true;
  trial.step.resize(trial.time.size());
  trial.predicted = Eigen::MatrixXd::Constant(trial.time.size(), 6, std::nan(""));
  trial.predicted_sigma = trial.predicted;
  for (Eigen::Index i = 0; i < trial.time.size(); ++i) {
    trial.step[i] = static_cast<int>(i / 50);
    if (i % 50 != 25) continue;
    // One reading of each hold, 3 % too much, and sigmas of 2 % of the load and 1 mN.
    trial.predicted.row(i) = 1.03 * trial.reference.row(i);
    trial.predicted_sigma.row(i) = 0.02 * trial.reference.row(i).cwiseAbs().array() + 1e-3;
  }
  const Analysis a = analyze({trial}, {});
  EXPECT_EQ(a.validation, "each step, by the calibration's own fit without it");
  EXPECT_EQ(a.time.size(), 24);
  EXPECT_TRUE(a.folds.empty());
  EXPECT_NEAR(a.axis[0].rmse, 0.03 * std::sqrt(2.0 / 24), 1e-9) << "N";
  EXPECT_NEAR(a.axis[0].r2, 1 - 0.03 * 0.03, 1e-9);
  EXPECT_EQ(*a.axis[0].coverage, 1);
  EXPECT_NEAR(a.cross_talk(0, 0), 3, 1e-6) << "% of range: the gain";
  EXPECT_NEAR(a.axis[0].nonlinearity_percent, 0, 1e-6) << "% of range";
  EXPECT_TRUE(std::isnan(a.axis[0].hysteresis_percent)) << "one reading of a hold rises nowhere";
  EXPECT_TRUE(a.axis[0].noise.has_value());
}

TEST(Analysis, AFoldWhoseReferenceDoesNotChangeHasNoScore) {
  Trial trial = LoadedPlatform().trial();
  // Constant in the first of five blocks, and on another axis nothing but noise.
  const Eigen::Index block = trial.reference.rows() / 5 + 60;
  trial.reference.col(0).head(block).setConstant(0.3);
  std::mt19937 random(3);
  std::normal_distribution<double> normal(0, 1e-3);
  for (Eigen::Index i = 0; i < block; ++i) trial.reference(i, 1) = normal(random);
  const Analysis a = analyze({trial}, {});
  ASSERT_EQ(a.folds.size(), 5U);
  EXPECT_TRUE(std::isnan(a.folds[0].r2[0]));
  EXPECT_TRUE(std::isnan(a.folds[0].r2[1]));
  EXPECT_GT(a.folds[0].r2[2], 0.9);
  EXPECT_FALSE(std::isnan(a.folds[2].r2[0]));
  EXPECT_TRUE(a.folds[0].lag_sought);
  EXPECT_EQ(study::analysis_text(a).find("e+"), std::string::npos);
}

TEST(Analysis, LoadsThatHangHaveNoLagInAnyFold) {
  Trial trial = steps(loads_in_turn(1), 1);
  trial.held = true;
  trial.step.resize(trial.time.size());
  for (Eigen::Index i = 0; i < trial.time.size(); ++i) trial.step[i] = static_cast<int>(i / 50);
  const Analysis a = analyze({trial}, {});
  ASSERT_FALSE(a.folds.empty());
  for (const study::Fold& fold : a.folds) {
    EXPECT_FALSE(fold.lag_sought);
    for (const double r2 : fold.r2) EXPECT_TRUE(std::isnan(r2)) << "one load a fold";
  }
}

TEST(Analysis, AxesOfOneReasonShareALine) {
  Analysis a;
  for (const std::size_t k : {1U, 4U}) {
    a.axis[k].calibrated = false;
    a.axis[k].reason = "never loaded";
  }
  EXPECT_EQ(study::excitation_warnings(a),
            std::vector<std::string>{"Fy My: not calibrated: never loaded"});
  a.own_predictions = true;
  EXPECT_EQ(study::excitation_warnings(a), std::vector<std::string>{"Fy My: never loaded"});
}

TEST(Analysis, IntervalsThatHoldTooFewErrorsAreSaid) {
  Analysis a;
  a.axis[0].coverage = 0.86;
  EXPECT_TRUE(study::coverage_warnings(a).empty());
  a.axis[0].coverage = 0.61;
  a.axis[3].coverage = 0.8;
  ASSERT_EQ(study::coverage_warnings(a).size(), 1U);
  EXPECT_NE(study::coverage_warnings(a)[0].find("(Fx 61 %, Mx 80 %)"), std::string::npos);
}

TEST(Analysis, RangesShowFourDigitsOfWhatWasLoaded) {
  Analysis a;
  a.axis[3].range_low = -0.0078312;
  a.axis[3].range_high = 0.0029;
  a.axis[3].full_scale = 0.0078312;
  EXPECT_NE(study::analysis_text(a).find("-0.007831  0.002900  N m"), std::string::npos)
      << study::analysis_text(a);
}

TEST(Analysis, WhatIsHeldOutIsNotLearnedFrom) {
  const Trial trial = LoadedPlatform().trial();
  AnalysisOptions options;
  options.guard = 0.2;  // s; with the lag, readings beside a block go with reference inside it
  const Analysis a = analyze({trial}, options);
  for (const study::Fold& fold : a.folds) {
    Trial other = trial;
    for (Eigen::Index i = 0; i < other.reference_time.size(); ++i) {
      if (other.reference_time[i] >= fold.from - 0.1 && other.reference_time[i] <= fold.to)
        other.reference.row(i) *= -3;
    }
    const Eigen::MatrixXd expected = predicted_between(a, fold.from, fold.to);
    ASSERT_GT(expected.rows(), 190);
    EXPECT_EQ(predicted_between(analyze({other}, options), fold.from, fold.to), expected);
  }
}

TEST(Analysis, SmoothingFiltersReadingsAndReferenceAlike) {
  LoadedPlatform platform;
  platform.noise = 30;
  AnalysisOptions smooth;
  smooth.smooth = true;
  const Trial trial = platform.trial();
  const Analysis plain = analyze({trial}, {});
  const Analysis filtered = analyze({trial}, smooth);
  EXPECT_NEAR(filtered.lag.value, platform.lag, 2e-3) << "s: both filters have no delay";
  for (std::size_t k = 0; k < 6; ++k) {
    // [1/4 1/2 1/4] leaves sqrt(3/8) of white noise.
    EXPECT_NEAR(filtered.axis[k].rmse / plain.axis[k].rmse, std::sqrt(0.375), 0.12);
  }
}

TEST(Analysis, DataThatCannotBeAnalyzedAreRefusedByName) {
  LoadedPlatform platform;
  const Trial good = platform.trial();
  Trial bad = good;
  bad.reference_time.array() += 1000;
  EXPECT_NE(complaint({bad}).find("no overlap"), std::string::npos) << complaint({bad});
  bad = good;
  bad.time[10] = bad.time[9];
  EXPECT_NE(complaint({bad}).find("reading 11: time"), std::string::npos) << complaint({bad});
  bad = good;
  bad.features(3, 3) = std::nan("");
  EXPECT_NE(complaint({bad}).find("not finite"), std::string::npos) << complaint({bad});
  bad = good;
  bad.feature_names[0] = "other";
  EXPECT_NE(complaint({good, bad}).find("features differ"), std::string::npos);
  EXPECT_NE(complaint({good, good}).find("same data twice"), std::string::npos);
  Trial ours = good;
  ours.sensor = "a";
  bad = good;
  bad.time.array() += 1e-3;
  bad.sensor = "b";
  EXPECT_NE(complaint({ours, bad}).find("different sensors"), std::string::npos);
  platform.seconds = 0.1;
  bad = platform.trial();
  EXPECT_NE(complaint({bad}).find("record more"), std::string::npos) << complaint({bad});
  EXPECT_NE(complaint({}).find("name a file"), std::string::npos);
  AnalysisOptions options;
  options.folds = 1;
  EXPECT_NE(complaint({good}, options).find("--folds"), std::string::npos);
}

}  // namespace
}  // namespace tagwrench::test
