// What is wrong with data is said, and what cannot be analyzed is refused by name.
#include <cmath>

#include "host/calibration/analysis/analysis.h"
#include "tests/unit/calibration/analysis/analyzed.h"

namespace tagwrench::test {
namespace {

using study::Analysis;
using study::AnalysisOptions;
using study::analyze;
using study::Trial;

TEST(AnalysisWarnings, AnAxisThatWasNeverOrHardlyLoadedIsNotCalibrated) {
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

TEST(AnalysisWarnings, AnAxisThatWasOnlyLoadedTogetherWithAnotherIsNotCalibrated) {
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

TEST(AnalysisWarnings, ABacklogAtTheStartIsLeftOut) {
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

TEST(AnalysisWarnings, ClocksThatRunApartAreNoticed) {
  LoadedPlatform platform;
  platform.seconds = 60;
  platform.lag_drift = 500e-6;
  EXPECT_WARNS(analyze({platform.trial()}, {}), "the two clocks run apart");
}

TEST(AnalysisWarnings, ChannelsFilteredDifferentlyAreNoticed) {
  Trial trial = LoadedPlatform().trial();
  for (Eigen::Index i = 1; i < trial.time.size(); ++i)
    trial.features.row(i).tail(3) =
        0.4 * trial.features.row(i).tail(3) + 0.6 * trial.features.row(i - 1).tail(3);
  EXPECT_WARNS(analyze({trial}, {}), "by itself each axis lags differently");
}

TEST(AnalysisWarnings, AReferenceOfTheWrongSignIsNoticed) {
  Trial trial = LoadedPlatform().trial();
  trial.reference = -trial.reference;
  EXPECT_WARNS(analyze({trial}, {}), "is the reference's sign reversed?");
}

TEST(AnalysisWarnings, AReferenceAtItsLimitIsNoticed) {
  Trial trial = LoadedPlatform().trial();
  trial.reference.col(2) = trial.reference.col(2).cwiseMin(0.8);
  EXPECT_WARNS(analyze({trial}, {}), "the reference's Fz stays at its most of 0.8 N");
}

TEST(AnalysisWarnings, GapsRepeatsConstantColumnsAndCoarseStepsAreSaid) {
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

TEST(AnalysisWarnings, LoadsOfOneSignAreSaidToBeThat) {
  LoadedPlatform platform;
  platform.bias[2] = 2.2;
  EXPECT_WARNS(analyze({platform.trial()}, {}), "Fz: loaded one way only");
}

TEST(AnalysisWarnings, AxesOfOneReasonShareALine) {
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

TEST(AnalysisWarnings, IntervalsThatHoldTooFewErrorsAreSaid) {
  Analysis a;
  a.axis[0].coverage = 0.86;
  EXPECT_TRUE(study::coverage_warnings(a).empty());
  a.axis[0].coverage = 0.61;
  a.axis[3].coverage = 0.8;
  ASSERT_EQ(study::coverage_warnings(a).size(), 1U);
  EXPECT_NE(study::coverage_warnings(a)[0].find("(Fx 61 %, Mx 80 %)"), std::string::npos);
}

TEST(AnalysisWarnings, DataThatCannotBeAnalyzedAreRefusedByName) {
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
  Trial here = good;
  Trial there = good;
  here.file = "a/push.data.csv";
  there.file = "b/push.data.csv";
  EXPECT_NE(complaint({here, there}).find("a/push.data.csv and b/push.data.csv: are the same data"),
            std::string::npos);
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
