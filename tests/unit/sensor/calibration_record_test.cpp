// What a calibration writes is what run reads, and what belongs to another target is refused.
#include <gtest/gtest.h>
#include <unistd.h>

#include <Eigen/Geometry>
#include <filesystem>
#include <fstream>
#include <functional>
#include <iterator>
#include <nlohmann/json.hpp>

#include "host/core/config_error.h"
#include "host/core/os/atomic_file.h"
#include "host/core/sha256.h"
#include "host/sensor/calibration_file.h"

namespace tagwrench {
namespace {

class CalibrationRecordFile : public testing::Test {
 protected:
  void SetUp() override {
    path_ = std::filesystem::path(testing::TempDir()) /
            ("calibration_record_test_" + std::to_string(::getpid()) + ".json");
    Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
    pose.translation() = Eigen::Vector3d(1e-3, -2e-3, 3e-3);
    for (Tag& tag : target_.tags) tag.platform_T_tag = pose;
    rest_.camera_T_platform = pose;
    rest_.appearance = ReferenceImage{4, 2, 25, {0, 1, 2, 3, 4, 5, 6, 255}};
  }
  void TearDown() override { std::filesystem::remove(path_); }

  Calibration example(FeatureKind kind) const {
    Calibration c;
    c.sensor = identity_of(camera_, target_, rest_);
    c.model.features.kind = kind;
    if (kind == FeatureKind::creep) c.model.features.time_constant = 16;
    if (kind == FeatureKind::hysteresis) c.model.features.play.setConstant(1e-5);
    const int count = feature_count(kind);
    c.model.K = Matrix6::Random();
    c.model.B = Vector6::Random();
    c.model.range << 1, 1, 2, 0.01, 0.01, 1e9;
    c.model.extra = Eigen::MatrixXd::Random(6, count - 6);
    const Eigen::MatrixXd root = Eigen::MatrixXd::Random(6 * (count + 1), 6 * (count + 1));
    c.model.parameter_covariance = root * root.transpose();
    c.model.model_covariance.setIdentity();
    c.model.error_at_full_load.setConstant(0.001);
    c.model.full_load.setConstant(2);
    c.record.date = "2026-05-02T10:00:00Z";
    c.record.plan = "six_orientations";
    c.record.notes = "21 \u00b0C, \"north\" bench";
    c.record.data_file = "calibration.data.csv";
    c.record.data_sha256 = sha256_hex("abc");
    c.record.lag = CalibrationLag{0.04, 0.001};
    c.record.axis.emplace();
    (*c.record.axis)[5].state = AxisState::spring_model;
    (*c.record.axis)[5].reason = "no torque about z was applied";
    (*c.record.axis)[0].held_out_rmse = 0.0012;
    c.record.missing = {"Mz"};
    c.record.trials = {{.features = c.model.features, .score = 0.97, .score_sigma = 0.1}};
    return c;
  }
  std::string text() const {
    std::ifstream in(path_);
    return std::string(std::istreambuf_iterator<char>(in), {});
  }
  std::string complaint() {
    try {
      WrenchModel model;
      load_calibration(path_, camera_, target_, rest_, model);
      read_calibration(path_);
    } catch (const ConfigError& e) {
      return e.what();
    }
    return "(accepted)";
  }
  void change(const std::function<void(nlohmann::json&)>& alter) {
    write_atomically(path_, calibration_text(example(FeatureKind::linear)));
    nlohmann::json json = nlohmann::json::parse(text());
    alter(json);
    std::ofstream(path_) << json;
  }

  std::filesystem::path path_;
  CameraModel camera_;
  TargetDescription target_;
  ReferenceOptions rest_;
};

TEST_F(CalibrationRecordFile, EveryNumberComesBackToTheBit) {
  for (int kind = 0; kind < kFeatureKinds; ++kind) {
    const Calibration c = example(static_cast<FeatureKind>(kind));
    write_atomically(path_, calibration_text(c));
    const Calibration back = read_calibration(path_);
    EXPECT_EQ(back.model.K, c.model.K);
    EXPECT_EQ(back.model.B, c.model.B);
    EXPECT_EQ(back.model.range, c.model.range);
    EXPECT_EQ(back.model.extra, c.model.extra);
    EXPECT_EQ(back.model.features.kind, c.model.features.kind);
    EXPECT_EQ(back.model.features.time_constant, c.model.features.time_constant);
    EXPECT_EQ(back.model.features.play, c.model.features.play);
    EXPECT_TRUE(back.model.parameter_covariance.isApprox(c.model.parameter_covariance, 1e-15));
    EXPECT_EQ(back.model.error_at_full_load, c.model.error_at_full_load);
    EXPECT_EQ(back.model.full_load, c.model.full_load);
    EXPECT_EQ(back.record.notes, c.record.notes);
    EXPECT_EQ(back.record.data_sha256, c.record.data_sha256);
    EXPECT_EQ(back.record.lag->value, 0.04);
    EXPECT_EQ((*back.record.axis)[5].reason, "no torque about z was applied");
    EXPECT_EQ((*back.record.axis)[5].state, AxisState::spring_model);
    EXPECT_EQ((*back.record.axis)[0].held_out_rmse, 0.0012);
    EXPECT_EQ(back.record.missing, c.record.missing);
    EXPECT_EQ(back.record.trials.at(0).score, 0.97);
    EXPECT_EQ(complaint(), "(accepted)");
  }
}

TEST_F(CalibrationRecordFile, ACurvatureThatIsHardlyKnownIsRead) {
  Calibration c = example(FeatureKind::quadratic);
  c.model.parameter_covariance(50, 50) = 1e13;  // (N/m^2)^2: 3 N at 1 mm
  write_atomically(path_, calibration_text(c));
  EXPECT_EQ(complaint(), "(accepted)");
  c.model.parameter_covariance(50, 50) = 1e25;
  write_atomically(path_, calibration_text(c));
  EXPECT_NE(complaint().find("which no sensor has"), std::string::npos);
}

TEST_F(CalibrationRecordFile, ATargetThatWasCalibratedAnewIsAnother) {
  write_atomically(path_, calibration_text(example(FeatureKind::linear)));
  ASSERT_EQ(complaint(), "(accepted)");
  const auto refused = [&] { return complaint().find("calibrated anew since; run `tagwrench"); };
  TargetDescription was = target_;
  target_.tags[1].platform_T_tag->translation().x() += 5e-6;  // m
  EXPECT_NE(refused(), std::string::npos);
  target_ = was;
  rest_.appearance->level[3] += 0.01F;  // two counts of 256
  EXPECT_NE(refused(), std::string::npos);
  rest_.appearance->level[3] -= 0.01F;
  rest_.camera_T_platform->translation().z() += 5e-6;  // m
  EXPECT_NE(refused(), std::string::npos);
}

TEST_F(CalibrationRecordFile, AnotherLensIsAnotherSensor) {
  write_atomically(path_, calibration_text(example(FeatureKind::linear)));
  camera_.fx_px = 806;
  EXPECT_NE(complaint().find("its lens (fx,fy,cx,cy) is [805,805,319.5,239.5], sensor.yaml has"),
            std::string::npos);
}

TEST_F(CalibrationRecordFile, RefusesWhatIsNoModelNamingTheKey) {
  using nlohmann::json;
  change([](json& j) { j["parameter_covariance"][40][40] = -1; });
  EXPECT_NE(complaint().find("\"parameter_covariance\" has a negative variance"),
            std::string::npos);
  change([](json& j) { j["parameter_covariance"][1][0] = 1e6; });
  EXPECT_NE(complaint().find("\"parameter_covariance\" is no covariance"), std::string::npos);
  change([](json& j) { j["parameter_covariance"].erase(41); });
  EXPECT_NE(complaint().find("\"parameter_covariance\" must have 42 rows"), std::string::npos);
  change([](json& j) { j["covariance"][0][1] = 5; });
  EXPECT_NE(complaint().find("\"covariance\" is no covariance"), std::string::npos);
  change([](json& j) { j["model"]["kind"] = "neural"; });
  EXPECT_NE(complaint().find("\"neural\", which this version does not know"), std::string::npos);
  change([](json& j) { j["model"] = {{"kind", "creep"}, {"time_constant_s", 0}}; });
  EXPECT_NE(complaint().find("\"time_constant_s\" must be greater than 0"), std::string::npos);
  change([](json& j) { j["model"]["kind"] = "quadratic"; });
  EXPECT_NE(complaint().find("\"extra\" must have 21 rows"), std::string::npos);
  change([](json& j) { j["error"]["full_load"][2] = 0; });
  EXPECT_NE(complaint().find("\"full_load\" must be greater than 0"), std::string::npos);
  change([](json& j) { j["sensor"]["tag_ids"] = std::string(100, 'x'); });
  EXPECT_NE(complaint().find("\"tag_ids\""), std::string::npos);
  change([](json& j) { j["axes"][2]["state"] = "guessed"; });
  EXPECT_NE(complaint().find("\"state\" of an axis is \"guessed\""), std::string::npos);
}

TEST_F(CalibrationRecordFile, AnInterruptedWriteLeavesTheOldOne) {
  write_atomically(path_, calibration_text(example(FeatureKind::linear)));
  const std::string before = text();
  EXPECT_THROW(write_atomically(path_ / "below", calibration_text(example(FeatureKind::creep))),
               std::exception);
  EXPECT_EQ(text(), before);
}

TEST(Sha256, OfTheStandardsExample) {  // FIPS 180-4, "abc"
  EXPECT_EQ(sha256_hex("abc"), "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
}

}  // namespace
}  // namespace tagwrench
