// The folder measured/ beside a sensor.yaml: what is taken from it, and what is not.
#include "host/sensor/measured_files.h"

#include <gtest/gtest.h>
#include <sys/resource.h>
#include <unistd.h>

#include <csignal>

#include "host/core/config_error.h"
#include "host/core/os/atomic_file.h"
#include "host/core/os/text_file.h"
#include "host/core/sha256.h"
#include "host/sensor/calibration_file.h"
#include "host/sensor/sensor_config.h"
#include "tests/support/temporary_folder.h"

namespace tagwrench {
namespace {

namespace fs = std::filesystem;

const char* const kSensor =
    "camera: {width: 64, height: 48, fx: 80, fy: 80, cx: 31.5, cy: 23.5, readout_ms: 5}\n"
    "target: {family: aruco_original, tag_size_mm: 3.8, tags: [{id: 5}, {id: 2}]}\n"
    "wrench:\n"
    "  springs: {centres_mm: [[1, 1, 0], [-1, 1, 0], [1, -1, 0], [-1, -1, 0]],\n"
    "            axial_n_per_mm: 0.7, lateral_n_per_mm: 0.07}\n";

/// As ROS's `cameracalibrator` saves it.
const char* const kCameraInfo =
    "image_width: 64\n"
    "image_height: 48\n"
    "camera_name: narrow_stereo\n"
    "camera_matrix:\n"
    "  rows: 3\n"
    "  cols: 3\n"
    "  data: [ 82.25,   0.  ,  30.75,\n"
    "           0.  ,  83.5 ,  22.25,\n"
    "           0.  ,   0.  ,   1.  ]\n"
    "distortion_model: plumb_bob\n"
    "distortion_coefficients:\n"
    "  rows: 1\n"
    "  cols: 5\n"
    "  data: [-0.05, 0.01, 1.0e-04, -0.0002, 0.]\n"
    "rectification_matrix:\n"
    "  rows: 3\n"
    "  cols: 3\n"
    "  data: [1., 0., 0., 0., 1., 0., 0., 0., 1.]\n"
    "projection_matrix:\n"
    "  rows: 3\n"
    "  cols: 4\n"
    "  data: [81., 0., 30.5, 0., 0., 82., 22., 0., 0., 0., 1., 0.]\n";

std::string changed(std::string text, const std::string& from, const std::string& to) {
  const std::size_t at = text.find(from);
  if (at == std::string::npos) throw std::logic_error("test text lacks " + from);
  return text.replace(at, from.size(), to);
}

class MeasuredFiles : public testing::Test {
 protected:
  MeasuredFiles() { write_atomically(sensor(), kSensor); }

  fs::path sensor() const { return folder_ / "sensor.yaml"; }
  fs::path measured(const char* file) const { return folder_ / kMeasuredFolder / file; }
  SensorConfig load(WrenchCalibration use = WrenchCalibration::use) const {
    return load_sensor(sensor(), use);
  }
  std::string complaint() const {
    try {
      load();
    } catch (const ConfigError& e) {
      EXPECT_EQ(std::string(e.what()).find('\n'), std::string::npos) << e.what();
      return e.what();
    }
    return "(accepted)";
  }
  void expect_refused(const std::vector<std::string>& parts) const {
    const std::string line = complaint();
    for (const std::string& part : parts)
      EXPECT_NE(line.find(part), std::string::npos) << "no '" << part << "' in: " << line;
  }

  static MeasuredStamp stamp() { return {"2026-05-02", "tagwrench 1", "sensor.yaml"}; }
  void measure_target() const {
    const SensorConfig now = load(WrenchCalibration::without_target);
    TargetFile file;
    file.stamp = stamp();
    file.target = now.target;
    for (Tag& tag : file.target.tags) {
      tag.platform_T_tag = Eigen::Isometry3d(Eigen::Translation3d(0, 1e-3 * tag.id, 0));
      tag.sigma = Vector6::Constant(1e-6);
    }
    file.rest = Eigen::Translation3d(0, 0, 21e-3);
    file.camera_sha256 = sha256_of(now.camera);
    file.readout = 18e-3;
    ReferenceImage picture{64, 48, 12, std::vector<float>(64 * 48, 100.0F)};
    picture.level[7] = level_;
    write_measured_target(folder_ / kMeasuredFolder, file, picture);
  }
  void measure_wrench() const {
    const SensorConfig now = load(WrenchCalibration::ignore);
    Calibration out;
    out.sensor = identity_of(now.camera, now.target, now.rest);
    out.model.K = 100 * Matrix6::Identity();
    out.model.range.setOnes();
    out.record.date = "2026-05-03T10:00:00Z";
    write_measured(measured(kMeasuredWrench), "");
    write_atomically(measured(kMeasuredWrench), calibration_text(out));
  }
  void measure_zero() const {
    const SensorConfig now = load(WrenchCalibration::zero_that_fits);
    write_measured(measured(kMeasuredZero),
                   zero_yaml({stamp(), Vector6::Constant(0.25),
                              sha256_of(identity_of(now.camera, now.target, now.rest)),
                              sha256_of(now.wrench)}));
  }

  test::TemporaryFolder temporary_;
  fs::path folder_ = temporary_.path();
  mutable float level_ = 50;
};

TEST_F(MeasuredFiles, ACameraInfoOfAnotherProgramIsTaken) {
  write_measured(measured(kMeasuredCamera), kCameraInfo);
  const SensorConfig sensor = load();
  EXPECT_EQ(sensor.camera.fx_px, 82.25);
  EXPECT_EQ(sensor.camera.fy_px, 83.5);
  EXPECT_EQ(sensor.camera.cx_px, 30.75);
  EXPECT_EQ(sensor.camera.cy_px, 22.25);
  EXPECT_EQ(sensor.camera.distortion, (std::array<double, 5>{-0.05, 0.01, 1e-4, -2e-4, 0}));
  EXPECT_EQ(sensor.camera.readout, 5e-3) << "that the file does not tell";
  EXPECT_EQ(in_force(sensor)[0], "camera: measured/camera.yaml");
  fs::remove(measured(kMeasuredCamera));
  EXPECT_EQ(load().camera.fx_px, 80);
  EXPECT_EQ(in_force(load())[0], "camera: sensor.yaml");
}

TEST_F(MeasuredFiles, ACameraInfoSpeaksOfTheImageAsAMirroringCameraDeliversIt) {
  write_atomically(sensor(), changed(kSensor, "readout_ms", "mirrored: true, readout_ms"));
  write_measured(measured(kMeasuredCamera), kCameraInfo);
  const CameraModel camera = load().camera;
  EXPECT_TRUE(camera.mirrored);
  EXPECT_DOUBLE_EQ(camera.cx_px, 63 - 30.75);
  EXPECT_DOUBLE_EQ(camera.distortion[2], 1e-4);
  EXPECT_DOUBLE_EQ(camera.distortion[3], 2e-4);
}

TEST_F(MeasuredFiles, ACameraInfoThatCannotBeMeantIsRefused) {
  const auto refuse = [&](const std::string& from, const std::string& to,
                          const std::vector<std::string>& parts) {
    write_measured(measured(kMeasuredCamera), changed(kCameraInfo, from, to));
    expect_refused(parts);
    expect_refused({"measured/camera.yaml"});
  };
  refuse("plumb_bob", "equidistant", {"distortion_model: 'equidistant'", "plumb_bob"});
  refuse("cols: 5\n  data: [-0.05, 0.01, 1.0e-04, -0.0002, 0.]",
         "cols: 8\n  data: [0, 0, 0, 0, 0, 0, 0, 0]", {"distortion_coefficients", "is 8"});
  refuse("-0.0002, 0.]", "-0.0002]", {"5 numbers, has 4"});
  refuse("image_width: 64", "image_width: 128",
         {"is of 128x48 pixels, but sensor.yaml's camera is 64x48"});
  refuse("82.25,   0.  ", "82.25,   0.5 ", {"without skew"});
  refuse("82.25", "0.", {"was not calibrated"});
  refuse("82.25", ".nan", {"finite"});
  refuse("-0.05", "-9", {"folds the image"});
  refuse("image_height: 48\n", "", {"image_height"});
  refuse("camera_matrix:", "camera_matrix: [1\nx:", {"camera.yaml:"});
}

TEST_F(MeasuredFiles, TheCameraComesBackAsItWasWrittenAndOthersFindTheirKeys) {
  CameraFile file;
  file.camera = load().camera;
  file.camera.fx_px = 81.1234567;
  file.camera.distortion = {-0.1, 0.02, 3e-4, -4e-4, 0.005};
  file.mirrored = false;
  file.views = 24;
  file.rms_px = 0.021;
  file.stamp = stamp();
  const std::string text = camera_yaml(file, "my \"left\" one");
  write_measured(measured(kMeasuredCamera), text);
  const SensorConfig sensor = load();
  EXPECT_DOUBLE_EQ(sensor.camera.fx_px, 81.1234567);
  EXPECT_EQ(sensor.camera.distortion, file.camera.distortion);
  ASSERT_TRUE(sensor.camera_calibrated);
  EXPECT_EQ(sensor.camera_calibrated->views, 24);
  EXPECT_EQ(sensor.camera_calibrated->rms_px, 0.021);
  EXPECT_EQ(in_force(sensor)[0], "camera: measured/camera.yaml, of 2026-05-02");
  for (const char* key :
       {"image_width: 64\n", "image_height: 48\n", "camera_name: \"my \\\"left\\\" one\"\n",
        "camera_matrix:\n  rows: 3\n  cols: 3\n  data: [", "distortion_model: plumb_bob\n",
        "distortion_coefficients:\n  rows: 1\n  cols: 5\n  data: [",
        "rectification_matrix:\n  rows: 3\n  cols: 3\n  data: [1, 0, 0, 0, 1, 0, 0, 0, 1]\n",
        "projection_matrix:\n  rows: 3\n  cols: 4\n  data: [81.1234567, 0, 31.5, 0, "})
    EXPECT_NE(text.find(key), std::string::npos) << key << text;
}

TEST_F(MeasuredFiles, TheTargetWinsOverSensorYamlAndGoesBackWithItsFile) {
  write_atomically(sensor(), std::string(kSensor) +
                                 "rest: {position_mm: [0, 0, 30], rotation_rad: [0, 0, 0], "
                                 "appearance: nowhere.png}\n");
  measure_target();
  const SensorConfig sensor = load();
  EXPECT_NEAR(sensor.target.tags[0].platform_T_tag->translation().y(), 5e-3, 1e-12);  // m
  EXPECT_NEAR(sensor.target.tags[1].sigma[5], 1e-6, 1e-9);
  EXPECT_NEAR(sensor.rest.camera_T_platform->translation().z(), 21e-3, 1e-12);
  ASSERT_TRUE(sensor.rest.appearance);
  EXPECT_EQ(sensor.rest.appearance->frames, 12);
  EXPECT_EQ(sensor.rest.appearance->level[7], 50.0F);
  EXPECT_DOUBLE_EQ(sensor.camera.readout, 18e-3);
  EXPECT_EQ(in_force(sensor)[1], "target: measured/target.yaml, of 2026-05-02");
  fs::remove(measured(kMeasuredTarget));
  expect_refused({"nowhere.png"});
  write_atomically(this->sensor(), kSensor);
  EXPECT_FALSE(load().rest.camera_T_platform);
  EXPECT_EQ(load().camera.readout, 5e-3);
}

TEST_F(MeasuredFiles, ATargetIsBoundToItsTagsItsCameraAndItsPicture) {
  measure_target();
  write_atomically(sensor(), changed(kSensor, "{id: 2}", "{id: 3}"));
  expect_refused({"measured/target.yaml: is of tags 2,5 of", "sensor.yaml has tags 3,5",
                  "calibrate target", "remove the file"});
  write_atomically(sensor(), changed(kSensor, "[{id: 5}, {id: 2}]", "[{id: 2}, {id: 5}]"));
  EXPECT_NEAR(load().target.tags[0].platform_T_tag->translation().y(), 2e-3, 1e-12) << "by id";
  write_atomically(sensor(), changed(kSensor, "fx: 80", "fx: 81"));
  expect_refused({"measured/target.yaml: was found with another camera", "calibrate target"});
  write_atomically(sensor(), kSensor);
  write_measured(measured(kMeasuredCamera), kCameraInfo);
  expect_refused({"another camera than the one of measured/camera.yaml"});
  fs::remove(measured(kMeasuredCamera));
  const std::string picture = read_text(measured(kMeasuredPicture));
  write_atomically(measured(kMeasuredPicture), picture + " ");
  expect_refused({"rest.png: is not the picture", "calibrate target"});
  fs::remove(measured(kMeasuredPicture));
  expect_refused({"rest.png: is missing"});
  EXPECT_NO_THROW(load(WrenchCalibration::without_target)) << "for who measures it anew";
  write_atomically(measured(kMeasuredPicture), picture);
  EXPECT_EQ(complaint(), "(accepted)");
  write_atomically(measured(kMeasuredTarget),
                   changed(read_text(measured(kMeasuredTarget)), "target-1", "target-2"));
  expect_refused({"target.yaml:1: format"});
}

TEST_F(MeasuredFiles, AMeasurementThatEndsBetweenPictureAndTargetLeavesTheOldPair) {
  measure_target();
  const std::string target = read_text(measured(kMeasuredTarget));
  for (const float level : {60.0F, 70.0F}) {  // twice: the pair in force must outlive both
    level_ = level;
    measure_target();
    write_atomically(measured(kMeasuredTarget), target);  // as if it had not come so far
    const SensorConfig now = load();
    EXPECT_EQ(now.rest.appearance->level[7], 50.0F);
    EXPECT_NE(in_force(now)[2].find("ended half-way, and measured/rest.png is its picture"),
              std::string::npos)
        << in_force(now)[2];
  }
}

TEST_F(MeasuredFiles, TheOneBeforeIsKept) {
  measure_target();
  const std::string first = read_text(measured(kMeasuredTarget));
  level_ = 60;
  measure_target();
  EXPECT_EQ(load().rest.appearance->level[7], 60.0F);
  EXPECT_EQ(read_text(measured("target.yaml.before")), first);
  fs::rename(measured("target.yaml.before"), measured(kMeasuredTarget));
  EXPECT_EQ(load().rest.appearance->level[7], 50.0F);
}

TEST_F(MeasuredFiles, WrenchAndZeroWinAndAreBound) {
  measure_target();
  measure_wrench();
  measure_zero();
  const SensorConfig sensor = load();
  EXPECT_EQ(sensor.wrench.K(0, 0), 100);
  EXPECT_EQ(sensor.zero.set[3], 0.25);
  EXPECT_EQ(in_force(sensor)[2], "wrench: measured/wrench.json, of 2026-05-03");
  EXPECT_EQ(in_force(sensor)[3], "zero: measured/zero.yaml, of 2026-05-02");
  level_ = 60;
  measure_target();
  expect_refused({"measured/wrench.json: was made for another sensor", "calibrate wrench"});
  measure_wrench();
  expect_refused({"measured/zero.yaml: was found with another camera or target",
                  "run `tagwrench zero`, or remove the file"});
  EXPECT_TRUE(load(WrenchCalibration::zero_that_fits).zero.set.isZero());
  measure_zero();
  fs::remove(measured(kMeasuredWrench));
  expect_refused({"zero.yaml: was found with another calibration in newtons"});
  fs::remove(measured(kMeasuredZero));
  EXPECT_NEAR(load().wrench.K(2, 2), 2800, 1e-9) << "the springs again";
  EXPECT_EQ(in_force(load())[2], "wrench: sensor.yaml's springs");
  EXPECT_EQ(in_force(load())[3], "zero: none is set");
}

TEST_F(MeasuredFiles, ACalibrationNeedsNoSprings) {
  measure_wrench();
  write_atomically(sensor(), changed(kSensor,
                                     "  springs: {centres_mm: [[1, 1, 0], [-1, 1, 0], [1, -1, 0], "
                                     "[-1, -1, 0]],\n            axial_n_per_mm: 0.7, "
                                     "lateral_n_per_mm: 0.07}\n",
                                     "  origin_mm: [0, 0, 0]\n"));
  EXPECT_EQ(load().wrench.K(0, 0), 100);
  fs::remove(measured(kMeasuredWrench));
  expect_refused({"wrench.calibration", "springs"});
}

TEST_F(MeasuredFiles, OfAnotherSensorInTheSameFolderAreRefused) {
  measure_target();
  write_atomically(folder_ / "right.yaml", kSensor);
  try {
    load_sensor(folder_ / "right.yaml");
    ADD_FAILURE() << "taken";
  } catch (const ConfigError& e) {
    EXPECT_NE(std::string(e.what()).find("was measured for sensor.yaml"), std::string::npos)
        << e.what();
  }
  fs::remove(sensor());  // renamed, then
  EXPECT_TRUE(load_sensor(folder_ / "right.yaml").rest.appearance);
}

TEST_F(MeasuredFiles, LieBesideTheFileThatALinkLeadsTo) {
  measure_target();
  fs::create_directory(folder_ / "config");
  fs::create_symlink("../sensor.yaml", folder_ / "config" / "sensor.yaml");
  EXPECT_TRUE(load_sensor(folder_ / "config" / "sensor.yaml").rest.appearance);
}

TEST_F(MeasuredFiles, AreNotLookedForBesideATextWithoutAFile) {
  measure_target();
  EXPECT_FALSE(parse_sensor(kSensor, sensor()).rest.camera_T_platform);
}

TEST_F(MeasuredFiles, StayWhenTheDiskIsFull) {
  measure_target();
  const std::string target = read_text(measured(kMeasuredTarget));
  std::signal(SIGXFSZ, SIG_IGN);
  rlimit old{};
  ::getrlimit(RLIMIT_FSIZE, &old);
  level_ = 60;
  for (const rlim_t bytes : {rlim_t{10}, rlim_t{300}}) {  // not the picture; not the target
    const rlimit small{bytes, old.rlim_max};
    ::setrlimit(RLIMIT_FSIZE, &small);
    EXPECT_THROW(measure_target(), std::runtime_error);
    ::setrlimit(RLIMIT_FSIZE, &old);
    EXPECT_EQ(read_text(measured(kMeasuredTarget)), target);
    EXPECT_EQ(load().rest.appearance->level[7], 50.0F) << bytes;
  }
}

TEST_F(MeasuredFiles, AreCheckedBeforeTheWork) {
  const fs::path folder = folder_ / kMeasuredFolder;
  EXPECT_NO_THROW(check_measurable(folder, {kMeasuredZero}));
  EXPECT_THROW(check_measurable(folder_ / "none" / kMeasuredFolder, {}), ConfigError);
  fs::create_directories(folder / kMeasuredZero);
  EXPECT_THROW(check_measurable(folder, {kMeasuredZero}), ConfigError);
  fs::remove_all(folder);
  write_atomically(folder, "a file");
  EXPECT_THROW(check_measurable(folder, {}), ConfigError);
}

}  // namespace
}  // namespace tagwrench
