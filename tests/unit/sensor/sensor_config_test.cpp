#include "host/sensor/sensor_config.h"

#include <gtest/gtest.h>

#include <fstream>

#include "host/core/config_error.h"

namespace tagwrench {
namespace {

// Line numbers in the expectations below count from the first line here.
const char* const kGood =
    "camera:  {width: 640, height: 480, fx: 805.0, fy: 806.0, cx: 319.5, cy: 239.5}\n"  // 1
    "target:\n"                                                                         // 2
    "  family: aruco_original\n"                                                        // 3
    "  tag_size_mm: 3.8\n"                                                              // 4
    "  tags:\n"                                                                         // 5
    "    - {id: 5}\n"                                                                   // 6
    "    - {id: 2}\n"                                                                   // 7
    "rest:    {frames: 30}\n"                                                           // 8
    "wrench:\n"                                                                         // 9
    "  springs:\n"                                                                      // 10
    "    centres_mm: [[11, 8, -10], [-11, 8, -10], [11, -8, -10], [-11, -8, -10]]\n"    // 11
    "    axial_n_per_mm: 0.7\n"                                                         // 12
    "    lateral_n_per_mm: 0.07\n";                                                     // 13

std::string replaced(std::string text, const std::string& from, const std::string& to) {
  const std::size_t at = text.find(from);
  if (at == std::string::npos) throw std::logic_error("test text lacks " + from);
  return text.replace(at, from.size(), to);
}

std::string complaint(const std::string& text) {
  try {
    parse_sensor(text, "sensor.yaml");
  } catch (const ConfigError& e) {
    return e.what();
  }
  return "(accepted)";
}

TEST(SensorConfig, ReadsAFreshlyBuiltSensor) {
  const SensorConfig s = parse_sensor(kGood, "sensor.yaml");
  EXPECT_EQ(s.camera.width_px, 640);
  EXPECT_EQ(s.camera.fy_px, 806.0);
  EXPECT_FALSE(s.camera.mirrored);
  EXPECT_DOUBLE_EQ(s.target.tag_size, 3.8e-3);  // m
  ASSERT_EQ(s.target.tags.size(), 2u);
  EXPECT_EQ(s.target.tags[1].id, 2);
  EXPECT_FALSE(s.target.tags[1].platform_T_tag);
  EXPECT_EQ(s.rest.frames, 30);
  EXPECT_NEAR(s.wrench.K(2, 2), 2800.0, 1e-9);  // N/m, four springs of 0.7 N/mm
  EXPECT_EQ(s.spacemouse.vendor, 0x256f);
}

TEST(SensorConfig, SpringsMayStayBesideACalibration) {
  const std::string both =
      replaced(kGood, "  springs:\n", "  calibration: /nonexistent/c.json\n  springs:\n");
  EXPECT_NE(complaint(both).find("/nonexistent/c.json: cannot be read"), std::string::npos);
  const SensorConfig s = parse_sensor(both, "sensor.yaml", WrenchCalibration::ignore);
  EXPECT_EQ(s.calibration, "/nonexistent/c.json");
  ASSERT_TRUE(s.spring_stiffness);
  EXPECT_NEAR((*s.spring_stiffness)(2, 2), 2800.0, 1e-9);  // N/m
  EXPECT_EQ(s.wrench.K, *s.spring_stiffness);
}

TEST(SensorConfig, RemembersTheCalibrationOfTheCamera) {
  const auto with = [](const std::string& record) {
    return replaced(kGood, "cy: 239.5}", "cy: 239.5, calibrated: " + record + "}");
  };
  const SensorConfig s =
      parse_sensor(with("{date: 2026-05-02, views: 24, rms_px: 0.021}"), "sensor.yaml");
  ASSERT_TRUE(s.camera_calibrated);
  EXPECT_EQ(s.camera_calibrated->date, "2026-05-02");
  EXPECT_EQ(s.camera_calibrated->views, 24);
  EXPECT_EQ(s.camera_calibrated->rms_px, 0.021);
  EXPECT_FALSE(parse_sensor(kGood, "sensor.yaml").camera_calibrated);
  for (const char* bad :
       {"{date: May, views: 24, rms_px: 0.02}", "{views: 24, rms_px: 0.02}",
        "{date: 2026-05-02, views: 0, rms_px: 0.02}", "{date: 2026-05-02, views: 24, rms_px: -1}",
        "{date: 2026-05-02, views: 24, rms_px: 1, by: me}", "yes"}) {
    EXPECT_NE(complaint(with(bad)).find("sensor.yaml:1: camera.calibrated"), std::string::npos)
        << complaint(with(bad));
  }
}

// Of lenses as they are sold: a webcam's, a wide one's, one that bends the other way; and the
// strongest barrel that shows no direction twice in this image.
TEST(SensorConfig, AcceptsTheDistortionOfRealLenses) {
  for (const char* distortion : {"[-0.42, 0.21, 0.001, -0.002, -0.06]", "[0.3, 0.4, 0, 0, 0]",
                                 "[0, 0, 0, 0, 0]", "[-0.55, 0, 0, 0, 0]"}) {
    const std::string text =
        replaced(kGood, "fy: 806.0,", std::string("fy: 806.0, distortion: ") + distortion + ",");
    EXPECT_NO_THROW(parse_sensor(text, "sensor.yaml")) << distortion;
  }
}

TEST(SensorConfig, ReadsEveryOptionalKey) {
  const SensorConfig s = parse_sensor(
      replaced(
          replaced(kGood, "{id: 5}",
                   "{id: 5, position_mm: [1, 2, 3], rotation_rad: [0, 0, 1.5707963267948966], "
                   "position_sigma_mm: [0.004, 0.005, 0.006], rotation_sigma_rad: [0.001, 0.002, "
                   "0.003]}"),
          "fy: 806.0,", "fy: 806.0, distortion: [-0.1, 0.02, 3e-3, -4e-3, 0.05], mirrored: true,") +
          "  range_n: [1, 2, 3]\n"
          "  range_nm: [0.01, 0.02, 0.03]\n"
          "  origin_mm: [0, 0, 20]\n"
          "  frame_rotation_rad: [0, 0, 1.5707963267948966]\n"
          "mounting: {right: +y, toward_user: +x, down: -z}\n"
          "shaping: {full_scale_n: [2, 2, 4], dead_zone_nm: [0.001, 0.001, 0.001]}\n"
          "spacemouse: {id: '1209:00aB'}\n",
      "sensor.yaml");
  EXPECT_TRUE(s.camera.mirrored);
  EXPECT_EQ(s.camera.distortion[4], 0.05);
  ASSERT_TRUE(s.target.tags[0].platform_T_tag);
  // The tag's x axis lies along platform y.
  EXPECT_TRUE((*s.target.tags[0].platform_T_tag * Eigen::Vector3d(1e-3, 0, 0))
                  .isApprox(Eigen::Vector3d(1e-3, 3e-3, 3e-3)));
  EXPECT_DOUBLE_EQ(s.target.tags[0].sigma[2], 6e-6);  // m
  EXPECT_DOUBLE_EQ(s.target.tags[0].sigma[3], 1e-3);  // rad
  EXPECT_TRUE(s.target.tags[1].sigma.isZero());
  EXPECT_EQ(s.wrench.range[5], 0.03);
  EXPECT_DOUBLE_EQ(s.wrench.wrench_origin.z(), 0.02);
  EXPECT_TRUE(s.wrench.camera_R_wrench_frame.col(0).isApprox(Eigen::Vector3d::UnitY()));
  EXPECT_EQ(s.shaping.hid_R_camera(0, 1), 1.0);
  EXPECT_EQ(s.shaping.full_scale[2], 4.0);
  EXPECT_EQ(s.spacemouse.vendor, 0x1209);
  EXPECT_EQ(s.spacemouse.product, 0x00ab);
}

TEST(SensorConfig, FullDeflectionIsTwoThirdsOfTheRangeAlongTheUsersAxesUnlessItIsGiven) {
  const std::string sensor = std::string(kGood) +
                             "  range_n: [3, 6, 12]\n"
                             "  range_nm: [0.03, 0.06, 0.12]\n"
                             "mounting: {right: +y, toward_user: +x, down: -z}\n";
  const ShapingOptions usual;
  const ShapingOptions s = parse_sensor(sensor, "sensor.yaml").shaping;
  const Vector6 expected = (Vector6() << 4, 2, 8, 0.04, 0.02, 0.08).finished();  // N, N m
  EXPECT_TRUE(s.full_scale.isApprox(expected)) << s.full_scale.transpose();
  EXPECT_TRUE(s.dead_zone.cwiseQuotient(s.full_scale)
                  .isApprox(usual.dead_zone.cwiseQuotient(usual.full_scale)));

  const ShapingOptions given =
      parse_sensor(sensor + "shaping: {full_scale_n: [0.01, 1, 1]}\n", "sensor.yaml").shaping;
  EXPECT_EQ(given.full_scale[0], 0.01);
  EXPECT_LT(given.dead_zone[0], 0.001) << "a dead zone that nobody gave fits the full scale";
  EXPECT_DOUBLE_EQ(given.full_scale[5], 0.08);

  const ShapingOptions unknown = parse_sensor(kGood, "sensor.yaml").shaping;
  EXPECT_EQ(unknown, usual) << "nobody said what it measures";
}

struct BadCase {
  const char* name;
  const char* from;
  const char* to;
  const char* starts_with;
  const char* contains;
};

class SensorConfigRefuses : public testing::TestWithParam<BadCase> {};

TEST_P(SensorConfigRefuses, NamingKeyAndLine) {
  const BadCase& bad = GetParam();
  const std::string line = complaint(replaced(kGood, bad.from, bad.to));
  EXPECT_EQ(line.rfind(bad.starts_with, 0), 0u) << line;
  EXPECT_NE(line.find(bad.contains), std::string::npos) << line;
  EXPECT_EQ(line.find('\n'), std::string::npos) << "one line: " << line;
}

INSTANTIATE_TEST_SUITE_P(
    All, SensorConfigRefuses,
    testing::Values(
        BadCase{"UnknownKey", "fy: 806.0", "fy: 806.0, fz: 1",
                "sensor.yaml:1: camera.fz:", "unknown key"},
        BadCase{"UnknownTopLevelKey", "rest: ", "rets: ", "sensor.yaml:8: rets:", "unknown key"},
        BadCase{"UnknownKeyInATag", "{id: 2}", "{id: 2, size: 3}",
                "sensor.yaml:7: target.tags[1].size:", "unknown key"},
        BadCase{"SigmaWithoutAPose", "{id: 2}",
                "{id: 2, position_sigma_mm: [1, 1, 1], rotation_sigma_rad: [1, 1, 1]}",
                "sensor.yaml:7: target.tags[1].position_sigma_mm:", "no pose"},
        BadCase{"HalfASigma", "{id: 2}", "{id: 2, rotation_sigma_rad: [1, 1, 1]}",
                "sensor.yaml:7: target.tags[1].rotation_sigma_rad:", "belong together"},
        BadCase{"NegativeSigma", "{id: 2}",
                "{id: 2, position_mm: [1, 2, 3], rotation_rad: [0, 0, 0], position_sigma_mm: [1, "
                "1, -1], rotation_sigma_rad: [1, 1, 1]}",
                "sensor.yaml:7: target.tags[1].position_sigma_mm:", "negative"},
        BadCase{"KeyTwice", "  tag_size_mm: 3.8", "  tag_size_mm: 3.8\n  tag_size_mm: 4",
                "sensor.yaml:5: target.tag_size_mm:", "twice"},
        BadCase{"WrongType", "width: 640", "width: wide",
                "sensor.yaml:1: camera.width:", "whole number"},
        BadCase{"WrongTypeMapping",
                "{width: 640, height: 480, fx: 805.0, fy: 806.0, cx: 319.5, cy: 239.5}", "7",
                "sensor.yaml:1: camera:", "mapping"},
        BadCase{"MissingKey", "fx: 805.0, ", "", "sensor.yaml:1: camera.fx:", "missing"},
        BadCase{"NoTags", "  tags:\n    - {id: 5}\n    - {id: 2}\n", "  tags: []\n",
                "sensor.yaml:5: target.tags:", "at least one"},
        BadCase{"MissingTags", "  tags:\n    - {id: 5}\n    - {id: 2}\n", "",
                "sensor.yaml:3: target.tags:", "missing"},
        BadCase{"TagTwice", "{id: 2}", "{id: 5}", "sensor.yaml:7: target.tags[1].id:", "twice"},
        BadCase{"TagOutOfItsFamily", "{id: 2}", "{id: 1024}",
                "sensor.yaml:7: target.tags[1].id:", "0 to 1023"},
        BadCase{"HalfAPose", "{id: 2}", "{id: 2, position_mm: [0, 0, 0]}",
                "sensor.yaml:7: target.tags[1].position_mm:", "together"},
        BadCase{"UnknownFamily", "aruco_original", "aruco_9x9",
                "sensor.yaml:3: target.family:", "use one of"},
        BadCase{"NonPositiveSize", "tag_size_mm: 3.8", "tag_size_mm: 0",
                "sensor.yaml:4: target.tag_size_mm:", "must be 0.01 to 10000, is 0"},
        BadCase{"NaN", "tag_size_mm: 3.8", "tag_size_mm: .nan",
                "sensor.yaml:4: target.tag_size_mm:", "finite"},
        BadCase{"FocalLengthBeyondMeasure", "fx: 805.0", "fx: 1e9",
                "sensor.yaml:1: camera.fx:", "must be 1 to 1000000, is"},
        BadCase{"CentreBeyondMeasure", "cx: 319.5", "cx: -1e6",
                "sensor.yaml:1: camera.cx:", "must be -100000 to 100000"},
        BadCase{"PlaceBeyondMeasure", "{id: 2}",
                "{id: 2, position_mm: [1e300, 2, 3], rotation_rad: [0, 0, 0]}",
                "sensor.yaml:7: target.tags[1].position_mm:", "beyond all measure"},
        BadCase{"StiffnessBeyondMeasure", "axial_n_per_mm: 0.7", "axial_n_per_mm: 1e300",
                "sensor.yaml:12: wrench.springs.axial_n_per_mm:", "beyond all measure"},
        BadCase{"Infinity", "axial_n_per_mm: 0.7", "axial_n_per_mm: .inf",
                "sensor.yaml:12: wrench.springs.axial_n_per_mm:", "finite"},
        BadCase{"WrongShape", "[11, 8, -10], [-11, 8, -10]", "[11, 8], [-11, 8, -10]",
                "sensor.yaml:11: wrench.springs.centres_mm:", "entry 1 must have 3"},
        BadCase{"FoldedImage", "cx: 319.5", "cx: 319.5, distortion: [-5, 0, 0, 0, 0]",
                "sensor.yaml:1: camera.distortion:", "folds the image"},
        BadCase{"FoldedImageThatUnfoldsFurtherOut", "cx: 319.5",
                "cx: 319.5, distortion: [-6, 15, 0, 0, 0]",
                "sensor.yaml:1: camera.distortion:", "folds the image"},
        BadCase{"ImageFoldedByTheTangentialPart", "cx: 319.5",
                "cx: 319.5, distortion: [0, 0, 2, 0, 0]",
                "sensor.yaml:1: camera.distortion:", "folds the image"},
        BadCase{"WrongDistortion", "cx: 319.5", "cx: 319.5, distortion: [0, 0]",
                "sensor.yaml:1: camera.distortion:", "5 numbers, has 2"},
        BadCase{"NegativeReadout", "cx: 319.5", "cx: 319.5, readout_ms: -1",
                "sensor.yaml:1: camera.readout_ms:", "from 0 "},
        BadCase{"ReadoutLongerThanAnyFrame", "cx: 319.5", "cx: 319.5, readout_ms: 200.5",
                "sensor.yaml:1: camera.readout_ms:", "to 200, is 200.5"},
        BadCase{"LatencyLongerThanAnyCamera", "cx: 319.5", "cx: 319.5, latency_ms: 501",
                "sensor.yaml:1: camera.latency_ms:", "to 500, is 501"},
        BadCase{"NoSpringsNoCalibration", "  springs:\n", "  strings:\n",
                "sensor.yaml:10: wrench.calibration:", "either"},
        BadCase{"NoSuchCalibration", "  springs:\n",
                "  calibration: /nonexistent/c.json\n  strings:\n",
                "/nonexistent/c.json:", "cannot be read"},
        BadCase{"AppearanceWithoutAName", "rest:    {frames: 30}",
                "rest:    {position_mm: [0, 0, 21], rotation_rad: [0, 0, 0], appearance: ''}",
                "sensor.yaml:8: rest.appearance:", "names no file"},
        BadCase{"NotYaml", "{id: 2}", "{id: 2", "sensor.yaml:", "not YAML"},
        BadCase{"EmptyWrench", "rest:    {frames: 30}", "rest:    {frames: 0}",
                "sensor.yaml:8: rest.frames:", "1 to 1000"}),
    [](const auto& param) { return std::string(param.param.name); });

TEST(SensorConfig, ReadsZeroAndReference) {
  const SensorConfig plain = parse_sensor(kGood, "sensor.yaml");
  EXPECT_TRUE(plain.zero.follow);
  EXPECT_TRUE(plain.zero.set.isZero());
  EXPECT_FALSE(plain.reference);
  const SensorConfig s = parse_sensor(
      std::string(kGood) +
          "  zero_n: [0.01, -0.02, 0.03]\n  zero_nm: [0.001, 0, 0]\n  zero_date: '2026-05-02'\n"
          "  zero_tracking: false\n  zero_band_percent: 1\n  zero_rate_percent_per_s: 0.05\n"
          "  reference: {channel: 2, point_mm: [1, 2, 3], direction: [0, 0, -2]}\n",
      "sensor.yaml");
  EXPECT_FALSE(s.zero.follow);
  EXPECT_DOUBLE_EQ(s.zero.set[2], 0.03);   // N
  EXPECT_DOUBLE_EQ(s.zero.set[3], 0.001);  // N m
  EXPECT_EQ(s.zero.date, "2026-05-02");
  EXPECT_DOUBLE_EQ(s.zero.band, 0.01);
  EXPECT_DOUBLE_EQ(s.zero.rate, 5e-4);  // of the range a second
  ASSERT_TRUE(s.reference);
  EXPECT_EQ(s.reference->channel, 2);
  EXPECT_DOUBLE_EQ(s.reference->point.y(), 2e-3);  // m
  EXPECT_EQ(s.reference->direction, Eigen::Vector3d(0, 0, -1));
}

TEST(SensorConfig, RefusesAZeroOrAReferenceThatCannotBe) {
  const auto says = [](const std::string& lines, const std::string& part) {
    const std::string said = complaint(std::string(kGood) + lines);
    EXPECT_NE(said.find(part), std::string::npos) << said;
  };
  says("  zero_n: [0, 0, 0]\n", "wrench.zero_n: zero_n and zero_nm belong together");
  says("  zero_n: [0, 0]\n  zero_nm: [0, 0, 0]\n", "wrench.zero_n");
  says("  zero_n: [0, 0, .nan]\n  zero_nm: [0, 0, 0]\n", "wrench.zero_n");
  says("  zero_date: yesterday\n", "'yesterday' is not YYYY-MM-DD");
  says("  zero_tracking: 2\n", "wrench.zero_tracking");
  says("  zero_band_percent: 11\n", "wrench.zero_band_percent");
  says("  zero_rate_percent_per_s: -1\n", "wrench.zero_rate_percent_per_s");
  says("  reference: {channel: 4, point_mm: [0, 0, 0], direction: [0, 0, 1]}\n",
       "wrench.reference.channel");
  says("  reference: {channel: 0, point_mm: [0, 0, 0], direction: [0, 0, 0]}\n", "has no length");
}

TEST(SensorConfig, RefusesALeftHandedMounting) {
  const std::string line =
      complaint(std::string(kGood) + "mounting: {right: +x, toward_user: +y, down: -z}\n");
  EXPECT_EQ(line.rfind("sensor.yaml:14: mounting.right:", 0), 0u) << line;
}

TEST(SensorConfig, RefusesADeadZoneBeyondFullScale) {
  const std::string line = complaint(std::string(kGood) + "shaping: {dead_zone_n: [5, 5, 5]}\n");
  EXPECT_NE(line.find("shaping.dead_zone_n: must be smaller"), std::string::npos) << line;
}

TEST(SensorConfig, ADeadZoneMayBeNothingButNotLess) {
  const std::string shaping = "shaping: {dead_zone_n: [0, 0.1, 0]}\n";
  const SensorConfig s = parse_sensor(std::string(kGood) + shaping, "sensor.yaml");
  EXPECT_EQ(s.shaping.dead_zone[0], 0);
  EXPECT_EQ(s.shaping.dead_zone[1], 0.1);
  EXPECT_EQ(s.shaping.dead_zone[3], ShapingOptions{}.dead_zone[3]);
  EXPECT_NE(complaint(std::string(kGood) + "shaping: {dead_zone_nm: [0, -1, 0]}\n")
                .find("shaping.dead_zone_nm: must not be negative"),
            std::string::npos);
}

TEST(SensorConfig, RefusesTheIdThatTheKernelKeepsForRealDevices) {
  EXPECT_NE(complaint(std::string(kGood) + "spacemouse: {id: '046d:c626'}\n").find("hid-logitech"),
            std::string::npos);
  EXPECT_NE(complaint(std::string(kGood) + "spacemouse: {id: '46d:c626'}\n").find("hexadecimal"),
            std::string::npos);
}

TEST(SensorConfig, NamesAFileThatCannotBeRead) {
  try {
    load_sensor("/nonexistent/sensor.yaml");
    FAIL();
  } catch (const ConfigError& e) {
    EXPECT_EQ(std::string(e.what()).rfind("/nonexistent/sensor.yaml: cannot be read", 0), 0u)
        << e.what();
  }
}

}  // namespace
}  // namespace tagwrench
