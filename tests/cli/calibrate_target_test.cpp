// `tagwrench calibrate target` as its users run it.
#include <gtest/gtest.h>

#include <opencv2/imgcodecs.hpp>

#include "host/sensor/sensor_config.h"
#include "tests/cli/bridge.h"

namespace tagwrench::test {
namespace {

class CalibrateTarget : public testing::Test {
 protected:
  // A rendered folder, and a sensor.yaml of its owner's beside it.
  void render(const std::string& scenario, int frames) {
    write_file(temporary_ / "scenario.yaml", scenario);
    const Outcome sim = run_bridge({"sim", "--scenario", temporary_ / "scenario.yaml", "--out",
                                    temporary_ / "frames", "--frames", std::to_string(frames)});
    ASSERT_EQ(sim.status, 0) << sim.err;
    write_file(sensor_, "# mine\n" + read_file(temporary_ / "frames" / "sensor.yaml"));
  }
  Outcome calibrate(const std::vector<std::string>& more = {}) {
    std::vector<std::string> arguments = {
        "calibrate", "target",   "--sensor",
        sensor_,     "--source", "images:" + (temporary_ / "frames").string()};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return run_bridge(arguments);
  }
  void expect_refused(const Outcome& outcome, const std::string& part) {
    EXPECT_EQ(outcome.status, 2) << outcome.err;
    EXPECT_EQ(outcome.out, "");
    const std::size_t last = outcome.err.rfind("tagwrench: ");
    ASSERT_NE(last, std::string::npos);
    EXPECT_NE(outcome.err.find(part, last), std::string::npos)
        << "no '" << part << "' in the last line of: " << outcome.err;
    EXPECT_EQ(read_file(sensor_), before_);
    EXPECT_FALSE(std::filesystem::exists(temporary_ / "sensor.yaml.rest"));
  }

  TemporaryFolder temporary_;
  std::filesystem::path sensor_ = temporary_ / "sensor.yaml";
  std::string before_;
};

TEST_F(CalibrateTarget, WritesPlacesAndPictureThatRunCanUse) {
  render("seed: 3\ntrajectory: {rest_s: 0.5}\n", 90);
  const SensorConfig before = load_sensor(sensor_);
  const Outcome outcome = calibrate();
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  EXPECT_EQ(outcome.out, "");
  EXPECT_NE(outcome.err.find("excited: x "), std::string::npos) << outcome.err;
  EXPECT_NE(outcome.err.find("written: "), std::string::npos) << outcome.err;
  EXPECT_EQ(read_file(sensor_).rfind("# mine\n", 0), 0u);

  const SensorConfig after = load_sensor(sensor_);
  EXPECT_EQ(after.camera.fx_px, before.camera.fx_px);
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();
  for (const Tag& tag : after.target.tags) {
    ASSERT_TRUE(tag.platform_T_tag);
    centre += tag.platform_T_tag->translation();
    EXPECT_GT(tag.sigma.minCoeff(), 0);
    EXPECT_LT(tag.sigma.head<3>().maxCoeff(), 10e-6);  // m
    EXPECT_LT(tag.sigma.tail<3>().maxCoeff(), 2e-3);   // rad
  }
  EXPECT_LT(centre.norm(), 5e-9);  // m: the origin is their midpoint
  ASSERT_TRUE(after.rest.camera_T_platform);
  EXPECT_TRUE(after.rest.camera_T_platform->linear().isIdentity());
  ASSERT_TRUE(after.rest.appearance);
  EXPECT_EQ(after.rest.appearance->frames, after.rest.frames);

  // Again, into a file of another name in another folder, over what is there already.
  std::filesystem::create_directory(temporary_ / "other");
  const std::filesystem::path copy = temporary_ / "other" / "it's mine.yaml";
  ASSERT_EQ(calibrate({"--out", copy}).status, 0);
  EXPECT_TRUE(load_sensor(copy).rest.appearance);
  EXPECT_EQ(read_file(copy), [&] {
    std::string same = read_file(sensor_);
    const std::string name = "'sensor.yaml.rest'";
    return same.replace(same.find(name), name.size(), "'it''s mine.yaml.rest'");
  }());

  const Outcome run =
      run_bridge({"run", "--fast", "--source", "images:" + (temporary_ / "frames").string(),
                  "--sensor", copy, "--output", "jsonl:" + (temporary_ / "o.jsonl").string()});
  EXPECT_EQ(run.status, 0) << run.err;
  const std::string samples = read_file(temporary_ / "o.jsonl");
  EXPECT_NE(samples.find("\"status\":\"ok\""), std::string::npos);
}

TEST_F(CalibrateTarget, APictureThatIsNotOfTheTargetIsRefusedByRunAndCuredByCalibrating) {
  render("seed: 3\ntrajectory: {rest_s: 0.5}\n", 90);
  ASSERT_EQ(calibrate().status, 0);
  EXPECT_EQ(load_sensor(sensor_).camera.readout, 0) << "of a global shutter";
  const std::string good = read_file(sensor_);
  const auto run = [&] {
    return run_bridge({"run", "--fast", "--source", "images:" + (temporary_ / "frames").string(),
                       "--sensor", sensor_, "--output", "jsonl:-", "--frames", "3"});
  };
  EXPECT_EQ(run().status, 0);

  std::string swapped = good;
  const std::size_t five = swapped.find("id: 5");
  const std::size_t two = swapped.find("id: 2");
  swapped[five + 4] = '2';
  swapped[two + 4] = '5';
  write_file(sensor_, swapped);
  const Outcome other = run();
  EXPECT_EQ(other.status, 2);
  EXPECT_EQ(other.out, "");
  EXPECT_EQ(lines_in(other.err), 1u) << other.err;
  EXPECT_NE(other.err.find("does not show tag 2"), std::string::npos) << other.err;
  EXPECT_NE(other.err.find("calibrate target"), std::string::npos) << other.err;

  write_file(sensor_, good);
  for (const double level : {0.0, 65535.0}) {
    std::vector<unsigned char> flat;
    cv::imencode(".png", cv::Mat(480, 640, CV_16UC1, cv::Scalar(level)), flat);
    write_file(temporary_ / "sensor.yaml.rest", std::string(flat.begin(), flat.end()));
    const Outcome blank = run();
    EXPECT_EQ(blank.status, 2);
    EXPECT_EQ(lines_in(blank.err), 1u) << blank.err;
    EXPECT_NE(blank.err.find("rest.appearance"), std::string::npos) << blank.err;
  }
  EXPECT_EQ(calibrate().status, 0);
  EXPECT_EQ(run().status, 0);
}

TEST_F(CalibrateTarget, ARollingShuttersReadOutIsWritten) {
  render(
      "seed: 3\nexposure: {rolling_readout_ms: 20}\n"
      "trajectory: {rest_s: 0.5, amplitude: [0.22, 0.2, 2.4, 0.004, 0.004, 0.003]}\n",
      150);
  const Outcome outcome = calibrate();
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  EXPECT_NE(outcome.err.find("camera.readout_ms is written"), std::string::npos) << outcome.err;
  EXPECT_NEAR(load_sensor(sensor_).camera.readout, 20e-3, 1e-3);  // s
}

TEST_F(CalibrateTarget, RefusesAndWritesNothing) {
  render("seed: 3\ntrajectory: {rest_s: 0.5, motion: push, axis: fz}\n", 60);
  before_ = read_file(sensor_);
  expect_refused(calibrate(), "hardly moved");
  expect_refused(calibrate({"--frames", "5"}), "rest of");
  expect_refused(calibrate({"--frames", "0"}), "not in range 1 to 2000000000");
  expect_refused(calibrate({"--seconds", "nan"}), "'nan' is not a number of seconds");
  expect_refused(calibrate({"--out", temporary_ / "frames"}), "not a regular file");
  expect_refused(run_bridge({"calibrate", "target", "--sensor", sensor_, "--source", "kinect"}),
                 "kinect");
  expect_refused(run_bridge({"calibrate", "target", "--sensor", sensor_}), "--source");
  before_ += "---\nb: 1\n";
  write_file(sensor_, before_);
  const Outcome twofold = calibrate();
  expect_refused(twofold, "second document");
  EXPECT_EQ(lines_in(twofold.err), 1u) << twofold.err;
}

}  // namespace
}  // namespace tagwrench::test
