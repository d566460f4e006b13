// The published recording of the design's authors, through the code that `tagwrench analyze` runs.
// It lies in the folder icra2020 of the environment variable TAGWRENCH_DATA.
#include <gtest/gtest.h>

#include <array>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <initializer_list>
#include <string>

#include "host/calibration/analysis/analysis.h"
#include "host/calibration/analysis/trial_csv.h"
#include "host/core/axis_names.h"

namespace tagwrench::test {
namespace {

using study::Analysis;

class PublishedRecording : public ::testing::Test {
 protected:
  void SetUp() override {
    const char* data = std::getenv("TAGWRENCH_DATA");
    if (data == nullptr) GTEST_SKIP() << "TAGWRENCH_DATA is not set";
    const auto folder = std::filesystem::path(data) / "icra2020";
    mapping_.readings = folder / "2019-09-13_120207_arucotagData.csv";
    mapping_.reference = folder / "2019-09-13_120207_optoforceData.csv";
    if (!std::filesystem::exists(mapping_.readings))
      GTEST_SKIP() << "TAGWRENCH_DATA does not hold the recording";
    mapping_.reading_time = std::string("2");
    mapping_.reference_time = std::string("2");
    for (const char* text :
         {"3-5:N:counts=96.11,95.64,20.92", "6-8:Nm:counts=5425.36,5524.60,8103.25"})
      mapping_.loads.push_back(study::parse_load_columns(text, "--load"));
    mapping_.zero_rows = 199;
    mapping_.skip_readings = 20;
  }

  Analysis analyze(std::initializer_list<const char*> features, double ridge, double hold_out) {
    for (const char* text : features)
      mapping_.features.push_back(study::parse_feature_columns(text, "--features"));
    study::AnalysisOptions options;
    options.smooth = true;
    options.ridge = ridge;
    options.hold_out = hold_out;
    Analysis analysis = study::analyze({study::read_mapped(mapping_).trial}, options);
    std::printf("lag %.1f ms; R2 held out", 1e3 * analysis.lag.value);
    for (const study::AxisReport& axis : analysis.axis) std::printf(" %.4f", axis.r2);
    std::printf("; in sample");
    for (const study::AxisReport& axis : analysis.axis) std::printf(" %.4f", axis.r2_in_sample);
    std::printf("\n");
    return analysis;
  }
  /// The authors' features: mean of both tags, with the smoothing of the angles undone.
  Analysis mean_pose(double hold_out) {
    return analyze({"15-17:m", "18-20:deg:unsmooth=0.2"}, 0, hold_out);
  }
  /// Both tags, rotations as vectors from rest.
  Analysis both_tags(double hold_out) {
    return analyze({"3-8:m", "9-11:deg:euler:unsmooth=0.2", "12-14:deg:euler:unsmooth=0.2"}, 1e-3,
                   hold_out);
  }
  static bool warns(const Analysis& analysis, const std::string& part) {
    for (const std::string& warning : analysis.warnings) {
      if (warning.find(part) != std::string::npos) return true;
    }
    return false;
  }

  study::CsvMapping mapping_;
};

TEST_F(PublishedRecording, InSampleScoresWithOneLagForAllAxes) {
  const Analysis a = mean_pose(0);
  const std::array expected{0.990, 0.996, 0.908, 0.997, 0.998, 0.909};
  for (std::size_t k = 0; k < 6; ++k)
    EXPECT_NEAR(a.axis[k].r2_in_sample, expected[k], 0.005) << kWrenchAxes[k];
  EXPECT_GT(a.lag.value, 0.025) << "s";
  EXPECT_LT(a.lag.value, 0.050) << "s";
}

TEST_F(PublishedRecording, MeanPoseOnTheLastThird) {
  const Analysis a = mean_pose(0.3);
  const std::array expected{0.931, 0.996, 0.711, 0.994, 0.997, 0.663};
  for (std::size_t k = 0; k < 6; ++k)
    EXPECT_NEAR(a.axis[k].r2, expected[k], 0.025) << kWrenchAxes[k];
}

TEST_F(PublishedRecording, BothTagsOnTheLastThird) {
  const Analysis a = both_tags(0.3);
  const std::array expected{0.979, 0.994, 0.915, 0.996, 0.995, 0.606};
  for (std::size_t k = 0; k < 6; ++k)
    EXPECT_GE(a.axis[k].r2, expected[k] - 0.005) << kWrenchAxes[k];
}

TEST_F(PublishedRecording, BothTagsInFiveBlocksWithTheLagFoundInEachFold) {
  const Analysis a = both_tags(0);
  const std::array expected{0.984, 0.992, 0.890, 0.994, 0.996, 0.845};
  for (std::size_t k = 0; k < 6; ++k)
    EXPECT_GE(a.axis[k].r2, expected[k] - 0.0005) << kWrenchAxes[k];
  ASSERT_EQ(a.folds.size(), 5U);
  for (const study::Fold& fold : a.folds) {
    EXPECT_TRUE(fold.lag.known);
    EXPECT_NEAR(fold.lag.value, a.lag.value, 5e-3) << "s";
  }
}

TEST_F(PublishedRecording, SaysWhatIsWrongWithIt) {
  const Analysis a = both_tags(0);
  EXPECT_TRUE(warns(a, "the first 199 rows of the reference are stamped within 26 ms"));
  EXPECT_NEAR(a.reference_rate, 100, 1) << "Hz, and not 125";
  EXPECT_FALSE(a.axis[5].calibrated);
  EXPECT_TRUE(warns(a, "Mz: not calibrated: hardly loaded"));
  EXPECT_TRUE(warns(a, ": the reference counts in steps of 0.048 N ("));
  EXPECT_TRUE(warns(a, "the combination -Fy +Mx was hardly excited"));
}

}  // namespace
}  // namespace tagwrench::test
