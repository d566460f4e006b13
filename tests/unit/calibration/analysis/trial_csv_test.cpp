// Files of trials, ours and other people's: what is written comes back, what is wrong is named.
#include "host/calibration/analysis/trial_csv.h"

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <numbers>

#include "host/core/config_error.h"
#include "tests/support/temporary_folder.h"
#include "tests/unit/calibration/analysis/loaded_platform.h"

namespace tagwrench::test {
namespace {

namespace fs = std::filesystem;

class TrialFiles : public ::testing::Test {
 protected:
  fs::path write(const std::string& name, const std::string& text) const {
    std::ofstream(folder_ / name, std::ios::binary) << text;
    return folder_ / name;
  }
  template <typename Read>
  static std::string complaint(Read read) {
    try {
      read();
    } catch (const ConfigError& e) {
      return e.what();
    }
    return "no complaint";
  }
  std::string read_complaint(const std::string& text) const {
    const fs::path file = write("x.data.csv", text);
    return complaint([&] { study::read_trial(file); });
  }
  std::string map_complaint(const std::string& text, char separator = 0) const {
    study::CsvMapping mapping;
    mapping.readings = write("x.csv", text);
    mapping.separator = separator;
    mapping.features = {study::parse_feature_columns("2:mm", "--features")};
    mapping.loads = {study::parse_load_columns("3:N", "--load")};
    return complaint([&] { study::read_mapped(mapping); });
  }

  test::TemporaryFolder temporary_;
  fs::path folder_ = temporary_.path();
};

#define EXPECT_SAYS(text, part) \
  EXPECT_NE((text).find(part), std::string::npos) << "it says: " << (text)

TEST_F(TrialFiles, ATrialComesBackBitForBit) {
  LoadedPlatform platform;
  platform.seconds = 2;
  study::Trial trial = platform.trial();
  trial.feature_sigma = Eigen::MatrixXd::Constant(trial.time.size(), 6, 1.0 / 3);
  trial.reference_sigma = Eigen::MatrixXd::Constant(trial.reference_time.size(), 6, 1e-3);
  trial.step = Eigen::VectorXi::LinSpaced(trial.time.size(), -1, 5);
  trial.held = true;
  trial.sensor = "d00e";
  trial.predicted = Eigen::MatrixXd::Constant(trial.time.size(), 6, 0.1);
  trial.predicted.row(3).setConstant(std::nan(""));
  trial.predicted_sigma = 0.3 * trial.predicted;
  const study::Trial back = study::read_trial(write("a.data.csv", study::trial_to_csv(trial)));
  EXPECT_EQ(back.name, trial.name);
  EXPECT_EQ(back.feature_names, trial.feature_names);
  EXPECT_EQ(back.time, trial.time);
  EXPECT_EQ(back.features, trial.features);
  EXPECT_EQ(back.feature_sigma, trial.feature_sigma);
  EXPECT_EQ(back.reference_time, trial.reference_time);
  EXPECT_EQ(back.reference, trial.reference);
  EXPECT_EQ(back.reference_sigma, trial.reference_sigma);
  EXPECT_EQ(back.step, trial.step);
  EXPECT_TRUE(back.held);
  EXPECT_EQ(back.sensor, trial.sensor);
  EXPECT_TRUE(back.predicted.row(3).array().isNaN().all());
  EXPECT_EQ(back.predicted.row(4), trial.predicted.row(4));
  EXPECT_EQ(back.predicted_sigma.row(4), trial.predicted_sigma.row(4));
}

TEST_F(TrialFiles, WhatIsNotKnownIsLeftOut) {
  LoadedPlatform platform;
  platform.seconds = 1;
  const study::Trial trial = platform.trial();
  const study::Trial back = study::read_trial(write("a.data.csv", study::trial_to_csv(trial)));
  EXPECT_EQ(back.step.size(), 0);
  EXPECT_EQ(back.feature_sigma.size(), 0);
  EXPECT_EQ(back.reference_sigma.size(), 0);
  EXPECT_FALSE(back.held);
}

TEST_F(TrialFiles, DamageIsNamedByFileAndLine) {
  const std::string head =
      "# tagwrench-data-1\nkind,t_s,dx_m,Fx_N,Fy_N,Fz_N,Mx_Nm,My_Nm,Mz_Nm\n"
      "reading,0.1,1e-6,,,,,,\n";
  EXPECT_SAYS(read_complaint(head + "reading,0.2,nan,,,,,,\n"), "x.data.csv:4: column 3 (dx_m)");
  EXPECT_SAYS(read_complaint(head + "reading,0.2,,,,,,,\n"), ":4: column 3 (dx_m) is empty");
  EXPECT_SAYS(read_complaint(head + "reading,0.2,1e-6,,\n"), ":4: 5 fields where the first row");
  EXPECT_SAYS(read_complaint(head + "reading,0.1,1e-6,,,,,,\n"), "times must grow");
  EXPECT_SAYS(read_complaint(head + "mark,0.2,1e-6,,,,,,\n"), "reading or reference");
  EXPECT_SAYS(read_complaint("kind,t_s,dx_m\nreading,1,2\n"), "does not begin with");
  EXPECT_SAYS(read_complaint("# tagwrench-data-1\nkind,t_s,dx_m,Fx_N\nreading,1,2,\n"), "six of");
  EXPECT_SAYS(read_complaint(""), "does not begin with");
  EXPECT_SAYS(read_complaint("# tagwrench-data-1\n"), "no rows");
  EXPECT_SAYS(complaint([&] { study::read_trial(folder_); }), "a folder");
  EXPECT_SAYS(complaint([&] { study::read_trial(folder_ / "none.csv"); }), "cannot be read");
}

TEST_F(TrialFiles, UnitsSeparatorsAndNamesOfOthersAreUnderstood) {
  study::CsvMapping mapping;
  mapping.readings = write("r.csv", "when\tx\ty\tnote\n10\t1.5\t-2\ta\n20\t2.5\t-3\tb\n");
  mapping.reading_time = "when";
  mapping.time_unit = study::parse_time_unit("ms", "--time-unit");
  mapping.features = {study::parse_feature_columns("x:mm", "--features"),
                      study::parse_feature_columns("y:deg", "--features")};
  mapping.reference = write("f.csv", "\xEF\xBB\xBFtext; 0.01; 100; +7\r\ntext; 0.02; 300; 8\r\n");
  mapping.reference_time = "2";
  mapping.loads = {study::parse_load_columns("3:N:counts=50:axes=Fz:negative", "--load"),
                   study::parse_load_columns("4:mNm:axes=Mx", "--load")};
  mapping.zero_rows = 1;
  const study::Trial trial = study::read_mapped(mapping).trial;
  EXPECT_EQ(trial.time, (Eigen::VectorXd{{0.010, 0.020}}));
  EXPECT_DOUBLE_EQ(trial.features(1, 0), 2.5e-3);
  EXPECT_DOUBLE_EQ(trial.features(1, 1), -3 * std::numbers::pi / 180);
  EXPECT_EQ(trial.feature_names, (std::vector<std::string>{"x", "y"}));
  EXPECT_DOUBLE_EQ(trial.reference(1, 2), -4);
  EXPECT_DOUBLE_EQ(trial.reference(1, 3), 1e-3);
  EXPECT_EQ(trial.reference(1, 0), 0);
}

TEST_F(TrialFiles, MillimetresThatAreCalledMetresAreSaid) {
  study::CsvMapping mapping;
  mapping.readings = write("r.csv", "t,x,y\n0,-1,0.5\n1,1,3.5\n2,0,1\n");
  mapping.loads = {study::parse_load_columns("3:N", "--load")};
  const auto notes = [&](const std::string& x, const std::string& y) {
    mapping.features = {study::parse_feature_columns(x, "--features"),
                        study::parse_feature_columns(y, "--features")};
    return study::read_mapped(mapping).notes;
  };
  EXPECT_TRUE(notes("x:mm", "y:deg").empty());
  EXPECT_TRUE(notes("x", "y").empty()) << "nobody knows what these are";
  const std::vector<std::string> said = notes("x:m", "y:rad");
  ASSERT_EQ(said.size(), 2u);
  EXPECT_SAYS(said[0], "column 2 (x) goes over 2 m, further than a platform on springs");
  EXPECT_SAYS(said[1], "column 3 (y) goes over 3 rad");
}

TEST_F(TrialFiles, AnExponentialSmoothingIsUndone) {
  const std::vector<double> raw{1, 4, -2, 0.5, 3};
  std::string text;
  double smooth = raw[0];
  for (std::size_t i = 0; i < raw.size(); ++i) {
    smooth = i == 0 ? raw[0] : 0.2 * raw[i] + 0.8 * smooth;
    text += std::to_string(i) + ";" + std::to_string(smooth) + ";0\n";
  }
  study::CsvMapping mapping;
  mapping.readings = write("r.csv", text);
  mapping.features = {study::parse_feature_columns("2:unsmooth=0.2", "--features")};
  mapping.loads = {study::parse_load_columns("3", "--load")};
  mapping.skip_readings = 1;
  const study::Trial trial = study::read_mapped(mapping).trial;
  ASSERT_EQ(trial.time.size(), 4);
  for (Eigen::Index i = 0; i < 4; ++i)
    EXPECT_NEAR(trial.features(i, 0), raw[static_cast<std::size_t>(i) + 1], 1e-5);
}

TEST_F(TrialFiles, EulerAnglesBecomeRotationVectorsFromRest) {
  // At rest turned by 90 degrees about z, so that the camera's y is its own x.
  study::CsvMapping mapping;
  mapping.readings = write("r.csv", "0,0,0,90,1\n1,0,0,90,2\n2,0,-2,90,3\n");
  mapping.features = {study::parse_feature_columns("2-4:deg:euler=xyz", "--features")};
  mapping.loads = {study::parse_load_columns("5", "--load")};
  mapping.rest_readings = 2;
  const study::Trial trial = study::read_mapped(mapping).trial;
  EXPECT_NEAR(trial.features.topRows(2).norm(), 0, 1e-12);
  EXPECT_NEAR(trial.features(2, 0), -2 * std::numbers::pi / 180, 1e-9) << "rad";
  EXPECT_NEAR(trial.features(2, 1), 0, 1e-9) << "rad";
}

TEST_F(TrialFiles, BadRowsOfOthersAreNamedByFileAndLine) {
  EXPECT_SAYS(map_complaint("0;1;2\n1;NaN;2\n"), "x.csv:2: column 2 is 'NaN'");
  EXPECT_SAYS(map_complaint("0;1;2\n1;;2\n"), "x.csv:2: column 2 is empty");
  EXPECT_SAYS(map_complaint("0;1;2\n1;1\n"), "x.csv:2: 2 fields where the first row has 3");
  EXPECT_SAYS(map_complaint("1;1;2\n0.5;1;2\n"), "x.csv:2: time runs backwards");
  EXPECT_SAYS(map_complaint("0;1,5;2\n1;1,6;2\n"), "decimal points");
  EXPECT_SAYS(map_complaint("0;1;2\n1;1;2\n", ','), "--separator");
  EXPECT_SAYS(map_complaint("0;1\n1;1\n"), "no column 3");
  EXPECT_SAYS(map_complaint("0;1;2\n"), "fewer than two rows");
  EXPECT_SAYS(map_complaint("t;x;f\n"), "no rows");
}

TEST_F(TrialFiles, NumbersThatNoInstrumentReadsAreNamedByFileLineAndColumn) {
  EXPECT_SAYS(map_complaint("0;1;2\n1;1e308;2\n"), "x.csv:2: column 2 is '1e308', which no");
  EXPECT_SAYS(map_complaint("0;1;2\n1;1;-2e12\n"), "x.csv:2: column 3 is '-2e12'");
  EXPECT_SAYS(map_complaint("0;1;2\n1e308;1;2\n"), "x.csv:2: column 1 is '1e308'");
  EXPECT_EQ(map_complaint("0;1;2\n1;1e12;2\n"), "no complaint");
  const std::string head =
      "# tagwrench-data-1\nkind,t_s,dx_m,Fx_N,Fy_N,Fz_N,Mx_Nm,My_Nm,Mz_Nm\n"
      "reading,0.1,1e-6,,,,,,\n";
  EXPECT_SAYS(read_complaint(head + "reference,0.2,,0,0,1e300,0,0,0\n"),
              "x.data.csv:4: column 6 (Fz_N) is '1e300'");
}

TEST_F(TrialFiles, TimesInNanosecondsSince1970AreNoAbsurdNumbers) {
  study::CsvMapping mapping;
  mapping.readings = write("r.csv", "1700000000000000000,1,2\n1700000000500000000,1,2\n");
  mapping.time_unit = study::parse_time_unit("ns", "--time-unit");
  mapping.features = {study::parse_feature_columns("2", "--features")};
  mapping.loads = {study::parse_load_columns("3", "--load")};
  const study::Trial trial = study::read_mapped(mapping).trial;
  EXPECT_NEAR(trial.time[1] - trial.time[0], 0.5, 1e-6) << "s";
}

TEST_F(TrialFiles, ATrialKnowsItsFile) {
  LoadedPlatform platform;
  platform.seconds = 1;
  const fs::path file = write("a.data.csv", study::trial_to_csv(platform.trial()));
  EXPECT_EQ(study::read_trial(file).file, file.string());
}

TEST_F(TrialFiles, RowsOfOneTimeAreLeftOutAndSaid) {
  study::CsvMapping mapping;
  mapping.readings = write("r.csv", "0,1,2\n1,1,2\n1,1,3\n2,1,4\n");
  mapping.features = {study::parse_feature_columns("2", "--features")};
  mapping.loads = {study::parse_load_columns("3", "--load")};
  const study::MappedTrial mapped = study::read_mapped(mapping);
  EXPECT_EQ(mapped.trial.time.size(), 3);
  ASSERT_EQ(mapped.notes.size(), 1U);
  EXPECT_SAYS(mapped.notes[0], "1 row with the time of the row before left out");
}

TEST_F(TrialFiles, DescriptionsThatMakeNoSenseAreRefused) {
  for (const char* text :
       {"3:furlong", "3:unsmooth=0", "3:unsmooth=1e-300", "3:unsmooth=2", "3:euler=abc"})
    EXPECT_THROW(study::parse_feature_columns(text, "--features"), ConfigError) << text;
  for (const char* text : {"3:m", "3:counts=0", "3:counts=1e-300", "3:counts=a", "3:axes=Fw"})
    EXPECT_THROW(study::parse_load_columns(text, "--load"), ConfigError) << text;
  EXPECT_THROW(study::parse_time_unit("h", "--time-unit"), ConfigError);
  study::CsvMapping mapping;
  mapping.readings = write("r.csv", "0,1,2,3\n1,1,2,4\n");
  mapping.features = {study::parse_feature_columns("2-3:euler", "--features")};
  mapping.loads = {study::parse_load_columns("4", "--load")};
  EXPECT_SAYS(complaint([&] { study::read_mapped(mapping); }), "three columns");
  mapping.features = {study::parse_feature_columns("2", "--features")};
  mapping.loads = {study::parse_load_columns("3:axes=Fx", "--load"),
                   study::parse_load_columns("4:axes=Fx", "--load")};
  EXPECT_SAYS(complaint([&] { study::read_mapped(mapping); }), "an axis twice");
  mapping.loads = {study::parse_load_columns("3-4:counts=1,2,3", "--load")};
  EXPECT_SAYS(complaint([&] { study::read_mapped(mapping); }), "3 counts");
}

}  // namespace
}  // namespace tagwrench::test
