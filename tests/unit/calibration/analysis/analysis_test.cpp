// What is built into an instrument of numbers is what its analysis says, on data that it has not
// seen.
#include "host/calibration/analysis/analysis.h"

#include <cmath>
#include <random>

#include "host/core/axis_names.h"
#include "tests/unit/calibration/analysis/analyzed.h"

namespace tagwrench::test {
namespace {

using study::Analysis;
using study::AnalysisOptions;
using study::analyze;
using study::Trial;

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
    EXPECT_NEAR(a.matrix(i, i), k(i, i), 0.01 * k(i, i)) << kWrenchAxes[i];
    const study::AxisReport& axis = a.axis[static_cast<std::size_t>(i)];
    EXPECT_TRUE(axis.calibrated) << axis.reason;
    EXPECT_GT(axis.r2, 0.998);
    EXPECT_LE(axis.r2, axis.r2_in_sample);
    EXPECT_GT(axis.coverage, 0.92);
    EXPECT_LT(axis.coverage, 0.98);
    for (const study::Fold& fold : a.folds) EXPECT_GT(fold.r2[static_cast<std::size_t>(i)], 0.99);
  }
  for (const study::Fold& fold : a.folds) EXPECT_NEAR(fold.lag.value, 0.040, 1e-3) << "s";
  EXPECT_EQ(all_warnings(a), "");
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
  EXPECT_EQ(a.axis[0].coverage, 1);
  EXPECT_NEAR(a.cross_talk(0, 0), 3, 1e-6) << "% of range: the gain";
  EXPECT_NEAR(a.axis[0].nonlinearity_percent, 0, 1e-6) << "% of range";
  EXPECT_TRUE(std::isnan(a.axis[0].hysteresis_percent)) << "one reading of a hold rises nowhere";
  EXPECT_TRUE(std::isfinite(a.axis[0].noise));
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

}  // namespace
}  // namespace tagwrench::test
