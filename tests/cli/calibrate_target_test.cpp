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
    before_ = "# mine\n" + read_file(temporary_ / "frames" / "sensor.yaml");
    write_file(sensor_, before_);
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
    EXPECT_FALSE(std::filesystem::exists(temporary_ / "measured"));
  }

  static std::string list(const Eigen::Vector3d& v) {
    return "[" + std::to_string(v.x()) + ", " + std::to_string(v.y()) + ", " +
           std::to_string(v.z()) + "]";
  }

  TemporaryFolder temporary_;
  std::filesystem::path measured_ = temporary_ / "measured";
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
  EXPECT_EQ(read_file(sensor_), before_);

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

  // Again, for a copy of another name in another folder.
  std::filesystem::create_directory(temporary_ / "other");
  const std::filesystem::path copy = temporary_ / "other" / "it's mine.yaml";
  for (int twice = 0; twice < 2; ++twice) {
    ASSERT_EQ(calibrate({"--out", copy}).status, 0);
    EXPECT_TRUE(load_sensor(copy).rest.appearance);
    EXPECT_EQ(read_file(copy), before_);
  }
  EXPECT_EQ(read_file(measured_ / "rest.png"),
            read_file(temporary_ / "other" / "measured" / "rest.png"));

  const Outcome run =
      run_bridge({"run", "--fast", "--source", "images:" + (temporary_ / "frames").string(),
                  "--sensor", copy, "--output", "jsonl:" + (temporary_ / "o.jsonl").string()});
  EXPECT_EQ(run.status, 0) << run.err;
  const std::string samples = read_file(temporary_ / "o.jsonl");
  EXPECT_NE(samples.find("\"status\":\"ok\""), std::string::npos);
  EXPECT_NE(run.err.find("target: measured/target.yaml, of 2"), std::string::npos) << run.err;
  std::filesystem::remove_all(temporary_ / "other" / "measured");
  const Outcome nominal =
      run_bridge({"run", "--fast", "--source", "images:" + (temporary_ / "frames").string(),
                  "--sensor", copy, "--output", "jsonl:" + (temporary_ / "n.jsonl").string()});
  EXPECT_EQ(nominal.status, 0) << nominal.err;
  EXPECT_NE(nominal.err.find("target: sensor.yaml; its rest is learned"), std::string::npos);
  EXPECT_EQ(samples.find("\"status\":\"acquiring\""), std::string::npos);
  EXPECT_NE(read_file(temporary_ / "n.jsonl").find("\"status\":\"acquiring\""), std::string::npos)
      << "it learns its rest again";
  EXPECT_FALSE(std::filesystem::exists(temporary_ / "other" / "measured")) << "run writes nothing";
}

TEST_F(CalibrateTarget, APictureThatIsNotOfTheTargetIsRefusedByRunAndCuredByCalibrating) {
  render("seed: 3\ntrajectory: {rest_s: 0.5}\n", 90);
  ASSERT_EQ(calibrate().status, 0);
  EXPECT_EQ(load_sensor(sensor_).camera.readout, 0) << "of a global shutter";
  const auto run = [&] {
    return run_bridge({"run", "--fast", "--source", "images:" + (temporary_ / "frames").string(),
                       "--sensor", sensor_, "--output", "jsonl:-", "--frames", "3"});
  };
  EXPECT_EQ(run().status, 0);

  const std::filesystem::path target = measured_ / "target.yaml";
  const std::string good = read_file(target);
  std::string swapped = good;
  const std::size_t five = swapped.find("id: 5");
  const std::size_t two = swapped.find("id: 2");
  swapped[five + 4] = '2';
  swapped[two + 4] = '5';
  write_file(target, swapped);
  const Outcome other = run();
  EXPECT_EQ(other.status, 2);
  EXPECT_EQ(other.out, "");
  EXPECT_EQ(lines_in(other.err), 1u) << other.err;
  EXPECT_NE(
      other.err.find("measured/target.yaml: the picture at rest shows tag 2 of aruco_original "
                     "where the rest pose puts tag 5"),
      std::string::npos)
      << other.err;
  EXPECT_NE(other.err.find("calibrate target"), std::string::npos) << other.err;

  write_file(target, good);
  std::vector<unsigned char> flat;
  cv::imencode(".png", cv::Mat(480, 640, CV_16UC1, cv::Scalar(0)), flat);
  write_file(measured_ / "rest.png", std::string(flat.begin(), flat.end()));
  const Outcome blank = run();
  EXPECT_EQ(blank.status, 2);
  EXPECT_EQ(lines_in(blank.err), 1u) << blank.err;
  EXPECT_NE(blank.err.find("rest.png: is not the picture that target.yaml was found with"),
            std::string::npos)
      << blank.err;
  EXPECT_EQ(calibrate().status, 0);
  EXPECT_EQ(run().status, 0);
}

TEST_F(CalibrateTarget, ASensorYamlOfAnEarlierVersionRunsAndItsPictureIsHeldAgainstTheTags) {
  render("seed: 3\ntrajectory: {rest_s: 0.5}\n", 90);
  ASSERT_EQ(calibrate().status, 0);
  // As earlier versions wrote it: places, rest and picture in sensor.yaml.
  const SensorConfig found = load_sensor(sensor_);
  std::string old = before_.substr(0, before_.find("  tags:")) + "  tags:\n";
  for (const Tag& tag : found.target.tags) {
    const Eigen::AngleAxisd turn(tag.platform_T_tag->linear());
    const Eigen::Vector3d p = 1e3 * tag.platform_T_tag->translation();
    const Eigen::Vector3d r = turn.angle() * turn.axis();
    old += "    - {id: " + std::to_string(tag.id) + ", position_mm: " + list(p) +
           ", rotation_rad: " + list(r) + "}\n";
  }
  old += "rest:\n  frames: 12\n  position_mm: " +
         list(1e3 * found.rest.camera_T_platform->translation()) +
         "\n  rotation_rad: [0, 0, 0]\n  appearance: sensor.yaml.rest\n" +
         before_.substr(before_.find("wrench:"));
  write_file(sensor_, old);
  std::filesystem::rename(measured_ / "rest.png", temporary_ / "sensor.yaml.rest");
  std::filesystem::remove_all(measured_);
  const auto run = [&] {
    return run_bridge({"run", "--fast", "--source", "images:" + (temporary_ / "frames").string(),
                       "--sensor", sensor_, "--output", "jsonl:-", "--frames", "3"});
  };
  const Outcome good = run();
  EXPECT_EQ(good.status, 0) << good.err;
  EXPECT_NE(good.out.find("\"status\":\"ok\""), std::string::npos);
  EXPECT_NE(good.err.find("target: sensor.yaml"), std::string::npos) << good.err;
  std::vector<unsigned char> flat;
  cv::imencode(".png", cv::Mat(480, 640, CV_16UC1, cv::Scalar(0)), flat);
  write_file(temporary_ / "sensor.yaml.rest", std::string(flat.begin(), flat.end()));
  const Outcome blank = run();
  EXPECT_EQ(blank.status, 2);
  EXPECT_EQ(lines_in(blank.err), 1u) << blank.err;
  EXPECT_NE(blank.err.find("rest.appearance"), std::string::npos) << blank.err;
  EXPECT_EQ(calibrate().status, 0) << "cures it";
  EXPECT_EQ(run().status, 0);
  EXPECT_EQ(read_file(sensor_), old);
}

TEST_F(CalibrateTarget, ARollingShuttersReadOutIsWritten) {
  render(
      "seed: 3\nexposure: {rolling_readout_ms: 20}\n"
      "trajectory: {rest_s: 0.5, amplitude: [0.22, 0.2, 2.4, 0.004, 0.004, 0.003]}\n",
      150);
  const Outcome outcome = calibrate();
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  EXPECT_NE(outcome.err.find("readout_ms is written"), std::string::npos) << outcome.err;
  EXPECT_NEAR(load_sensor(sensor_).camera.readout, 20e-3, 1e-3);  // s
}

TEST_F(CalibrateTarget, RefusesAndWritesNothing) {
  render("seed: 3\ntrajectory: {rest_s: 0.5, motion: push, axis: fz}\n", 60);
  expect_refused(calibrate(), "hardly moved");
  expect_refused(calibrate({"--frames", "5"}), "rest of");
  expect_refused(calibrate({"--frames", "0"}), "not in range 1 to 2000000000");
  expect_refused(calibrate({"--seconds", "nan"}), "'nan' is not a number of seconds");
  expect_refused(calibrate({"--out", temporary_ / "frames"}), "not a regular file");
  expect_refused(run_bridge({"calibrate", "target", "--sensor", sensor_, "--source", "kinect"}),
                 "kinect");
  expect_refused(run_bridge({"calibrate", "target", "--sensor", sensor_}), "--source");
}

}  // namespace
}  // namespace tagwrench::test
