// Large and fast motion: fits settle, and what a smeared picture cannot tell is in the covariance.
#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <opencv2/imgproc.hpp>
#include <opencv2/videoio.hpp>
#include <string>

#include "host/app/scenario_config.h"
#include "host/sensor/sensor_config.h"
#include "host/source/simulator/simulator_source.h"
#include "host/tracker/tracker.h"

namespace tagwrench::test {
namespace {

TEST(Motion, SmearedPicturesWidenTheCovarianceByAsMuchAsTheyErr) {
  constexpr int kRestFrames = 45, kFrames = 300;
  double squared = 0, smeared_squared = 0;
  int ok = 0, smeared = 0;
  for (const std::uint64_t seed : {1, 2, 3}) {
    sim::Scenario scenario = load_scenario(std::string(TAGWRENCH_SCENARIOS) + "/motion_blur.yaml");
    scenario.seed = seed;
    scenario.trajectory.bandwidth = 2;  // Hz: within an exposure the velocity hardly changes
    SensorConfig sensor = parse_sensor(sim::sensor_yaml(scenario), "the simulated sensor");
    const std::vector<sim::PlacedTag> placed = sim::placed_tags(scenario);
    for (std::size_t t = 0; t < placed.size(); ++t) {
      Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
      pose.linear() = placed[t].platform_T_tag.rotation;
      pose.translation() = placed[t].platform_T_tag.position;
      sensor.target.tags[t].platform_T_tag = pose;
    }
    Tracker tracker(sensor.camera, sensor.target, sensor.rest);
    SimulatorSource source(scenario, /*live=*/false);
    for (int i = 0; i < kRestFrames + kFrames; ++i) {
      Frame frame;
      source.read(frame);
      const Track track = tracker.track(frame);
      if (i < kRestFrames || track.status != Status::ok) continue;
      const Vector6 error = track.displacement - source.truth().exposed_displacement;
      const double square = error.dot(track.covariance.ldlt().solve(error));
      EXPECT_LT(error.head<2>().norm(), 50e-6) << "a wrong ok, frame " << i;
      EXPECT_LT(std::abs(error[2]), 150e-6) << "a wrong ok, frame " << i;
      squared += square;
      ++ok;
      if (source.truth().smear_px < 5) continue;
      smeared_squared += square;
      ++smeared;
    }
  }
  std::printf("ok %d of %d, nees %.2f; of %d that smear by 5 px and more %.2f\n", ok, 3 * kFrames,
              squared / ok, smeared, smeared_squared / smeared);
  EXPECT_GT(ok, 700);
  ASSERT_GT(smeared, 200);
  EXPECT_GT(squared / ok, 4.5);
  EXPECT_LT(squared / ok, 7.5);
  EXPECT_LT(smeared_squared / smeared, 7.5);  // 10 and more where nothing widens it
}

TEST(Motion, OfARealVideoFitsSettleInFewSteps) {
  const char* data = std::getenv("TAGWRENCH_DATA");
  if (!data) GTEST_SKIP() << "TAGWRENCH_DATA is not set; it names the folder with real recordings";
  const std::filesystem::path file = std::filesystem::path(data) / "real" / "phone_writing.avi";
  if (!std::filesystem::exists(file)) GTEST_SKIP() << "no " << file;
  cv::VideoCapture video(file.string());
  cv::Mat colours, grey;
  if (!video.read(colours)) GTEST_SKIP() << "this OpenCV cannot read " << file;
  CameraModel camera;
  camera.width_px = colours.cols;
  camera.height_px = colours.rows;
  camera.fx_px = camera.fy_px = 1600;  // by the phone's kind
  camera.cx_px = 0.5 * (colours.cols - 1);
  camera.cy_px = 0.5 * (colours.rows - 1);
  TargetDescription target;
  target.family = TagFamily::aruco_4x4_50;
  target.tags = {{0, {}}, {1, {}}, {2, {}}, {3, {}}};
  Tracker tracker(camera, target, {.frames = 1});
  int number = 0, ok = 0, whole = 0;
  do {
    cv::cvtColor(colours, grey, cv::COLOR_BGR2GRAY);
    Frame frame;
    frame.image = {grey.data, grey.cols, grey.rows, static_cast<int>(grey.step)};
    frame.capture_time = frame.latency_origin =
        TimePoint(Duration(std::llround(1e9 * number / 30.0)));
    frame.sequence = static_cast<std::uint64_t>(number++);
    const Track track = tracker.track(frame);
    if (track.status != Status::ok) continue;
    ++ok;
    if (track.tags_held == 4) ++whole;
  } while (video.read(colours));
  std::printf("ok %d of %d, %d with all four tags\n", ok, number, whole);
  EXPECT_GE(ok, number - 8);  // 18 were doubtful while patches came and went
  EXPECT_GE(whole, number - 9);
}

}  // namespace
}  // namespace tagwrench::test
