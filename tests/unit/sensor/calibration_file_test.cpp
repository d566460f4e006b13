#include "host/sensor/calibration_file.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>

#include "host/core/config_error.h"

namespace tagwrench {
namespace {

const char* const kCalibration = R"({"format": "tagwrench-calibration-1",
 "sensor": {"family": "aruco_original", "tag_ids": [5, 2], "tag_size_mm": 3.8, "image_px": [640, 480]},
 "K": [[280,0,0,0,0,0],[0,280,0,0,0,0],[0,0,2800,0,0,0],[0,0,0,0.2,0,0],[0,0,0,0,0.3,0],[0,0,1.5,0,0,0.05]],
 "B": [0.1,0,0,0,0,0],
 "range": [1,1,2,0.01,0.01,0.01]})";

class CalibrationFile : public testing::Test {
 protected:
  void SetUp() override {
    // Tests run side by side, each in a process of its own.
    path_ = std::filesystem::path(testing::TempDir()) /
            ("calibration_file_test_" + std::to_string(::getpid()) + ".json");
  }
  void TearDown() override { std::filesystem::remove(path_); }

  WrenchModel load(const std::string& text) {
    std::ofstream(path_) << text;
    WrenchModel model;
    load_calibration(path_, CameraModel{}, TargetDescription{}, ReferenceOptions{}, model);
    return model;
  }
  std::string complaint(const std::string& from, const std::string& to) {
    std::string text = kCalibration;
    text.replace(text.find(from), from.size(), to);
    try {
      load(text);
    } catch (const ConfigError& e) {
      return e.what();
    }
    return "(accepted)";
  }

  std::filesystem::path path_;
};

TEST_F(CalibrationFile, ReadsStiffnessOffsetAndRange) {
  const WrenchModel m = load(kCalibration);
  EXPECT_EQ(m.K(2, 2), 2800);   // N/m
  EXPECT_EQ(m.K(5, 2), 1.5);    // row 5 (Mz), column 2 (z)
  EXPECT_EQ(m.B[0], 0.1);       // N
  EXPECT_EQ(m.range[5], 0.01);  // N m
  EXPECT_EQ(m.model_covariance, Matrix6::Zero().eval());
}

TEST_F(CalibrationFile, RefusesTheCalibrationOfAnotherSensor) {
  EXPECT_NE(complaint("[5, 2]", "[5, 3]")
                .find("another sensor: its tag_ids is [5,3], sensor.yaml has [5,2]"),
            std::string::npos);
  EXPECT_NE(
      complaint("3.8", "4.0").find("another sensor: its tag_size_mm is 4, sensor.yaml has 3.8"),
      std::string::npos);
  EXPECT_NE(complaint("[640, 480]", "[1280, 720]").find("another sensor: its image_px"),
            std::string::npos);
  EXPECT_NE(complaint("aruco_original", "aruco_4x4_50").find("another sensor: its family"),
            std::string::npos);
}

TEST_F(CalibrationFile, RefusesWrongShapesNamingTheKey) {
  EXPECT_NE(complaint("[280,0,0,0,0,0],", "").find("\"K\" must be 6 rows of 6 numbers"),
            std::string::npos);
  EXPECT_NE(complaint("[280,0,0,0,0,0]", "[280,0,0,0,0]").find("\"K\" must have 6 numbers"),
            std::string::npos);
  EXPECT_NE(complaint("[0.1,0,0,0,0,0]", "[0.1,0,0,0,0,\"x\"]").find("\"B\""), std::string::npos);
  EXPECT_NE(complaint("[0.1,0,0,0,0,0]", "[1e999,0,0,0,0,0]").find("calibration"),
            std::string::npos);
  EXPECT_NE(complaint("[1,1,2,", "[1,1,-2,").find("\"range\" must be greater than 0"),
            std::string::npos);
}

TEST_F(CalibrationFile, RefusesOtherFilesAndTruncatedOnes) {
  EXPECT_NE(complaint("tagwrench-calibration-1", "tagwrench-calibration-2").find("\"format\""),
            std::string::npos);
  const std::string whole = kCalibration;
  for (std::size_t length = 0; length < whole.size(); length += 7) {
    EXPECT_THROW(load(whole.substr(0, length)), ConfigError) << length;
  }
}

}  // namespace
}  // namespace tagwrench
