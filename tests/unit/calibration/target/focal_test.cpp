// The focal length that a recording of the target tells beside the tags' places: whichever tags
// tell it, they must not contradict each other, nor accuse a camera that is right.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <opencv2/imgproc.hpp>
#include <opencv2/videoio.hpp>

#include "host/calibration/target/recorder.h"
#include "host/core/config_error.h"
#include "tests/unit/calibration/target/target_record.h"

namespace tagwrench {
namespace {

using Indices = std::vector<std::size_t>;

/// One recording as the owners of some of its tags each would have it.
class Subsets {
 public:
  Subsets(const CameraModel& camera, const TargetDescription& target, const ReferenceOptions& rest,
          const std::vector<Indices>& subsets)
      : camera_(camera), rest_(rest) {
    for (const Indices& subset : subsets) {
      TargetDescription part = target;
      part.tags.clear();
      for (const std::size_t tag : subset) part.tags.push_back(target.tags[tag]);
      targets_.push_back(part);
      records_.push_back(std::make_unique<TargetRecorder>(camera, part, rest, 100));
    }
  }

  void add(const Frame& frame) {
    for (const auto& record : records_) record->add(frame);
  }

  /// Of each subset; `complaint`: what its owner would be told.
  struct Result {
    TargetEstimate estimate;
    std::string complaint;
  };
  std::vector<Result> adjusted() const {
    std::vector<Result> out;
    for (std::size_t s = 0; s < records_.size(); ++s) {
      Result result;
      if (records_[s]->rest_known())
        result.estimate = adjust_target(records_[s]->at_rest(), records_[s]->keyframes());
      try {
        check_record(*records_[s], targets_[s], rest_);
        check_estimate(result.estimate, targets_[s], camera_);
      } catch (const ConfigError& e) {
        result.complaint = e.what();
      }
      std::printf("tags");
      for (const Tag& tag : targets_[s].tags) std::printf(" %d", tag.id);
      std::printf(": focal length times %.4f +- %.4f  %s\n", result.estimate.focal_ratio,
                  result.estimate.focal_sigma, result.complaint.c_str());
      out.push_back(std::move(result));
    }
    return out;
  }

 private:
  CameraModel camera_;
  ReferenceOptions rest_;
  std::vector<TargetDescription> targets_;
  std::vector<std::unique_ptr<TargetRecorder>> records_;
};

void expect_agreement(const std::vector<Subsets::Result>& results) {
  for (std::size_t a = 0; a < results.size(); ++a) {
    for (std::size_t b = a + 1; b < results.size(); ++b) {
      const TargetEstimate &one = results[a].estimate, &other = results[b].estimate;
      EXPECT_LE(std::abs(one.focal_ratio - other.focal_ratio),
                3 * std::hypot(one.focal_sigma, other.focal_sigma))
          << a << " and " << b;
    }
  }
}

/// Two tags on each face of the roof.
sim::Scenario four_tags() {
  sim::Scenario scenario = test::realistic(3);
  std::vector<sim::TagPlacement> tags;
  for (const double side : {-2.4e-3, 2.4e-3}) {  // m
    for (sim::TagPlacement tag : scenario.target.tags) {
      tag.position.x() += side;
      tag.id += side > 0 ? 40 : 0;
      tags.push_back(tag);
    }
  }
  scenario.target.tags = tags;
  return scenario;
}

TEST(TargetFocal, SubsetsOfTheTagsOfOneRecordingAgreeAndAreRight) {
  constexpr int kFrames = 225;
  const sim::Scenario scenario = four_tags();
  const SensorConfig sensor = parse_sensor(sim::sensor_yaml(scenario), "four tags");
  Subsets subsets(sensor.camera, sensor.target, sensor.rest,
                  {{0, 1}, {2, 3}, {0, 3}, {1, 2}, {0, 1, 2, 3}});
  SimulatorSource source(scenario, /*live=*/false);
  for (int i = 0; i < kFrames; ++i) {
    Frame frame;
    source.read(frame);
    subsets.add(frame);
  }
  const std::vector<Subsets::Result> results = subsets.adjusted();
  expect_agreement(results);
  for (const Subsets::Result& result : results) {
    EXPECT_EQ(result.complaint, "");
    EXPECT_LT(result.estimate.focal_sigma, 0.01) << "this motion tells it";
    EXPECT_NEAR(result.estimate.focal_ratio, 1, 3 * result.estimate.focal_sigma);
  }
}

TEST(TargetFocal, SubsetsOfTheTagsOfARealVideoAgreeAndDoNotAccuseTheCamera) {
  const char* data = std::getenv("TAGWRENCH_DATA");
  if (!data) GTEST_SKIP() << "TAGWRENCH_DATA is not set; it names the folder with real recordings";
  const std::filesystem::path file = std::filesystem::path(data) / "real" / "phone_writing.avi";
  if (!std::filesystem::exists(file)) GTEST_SKIP() << "no " << file;
  cv::VideoCapture video(file.string());
  cv::Mat colours, grey;
  if (!video.read(colours)) GTEST_SKIP() << "this OpenCV cannot read " << file;

  // A sheet that lies while a hand writes on it; about 1600 px by the phone's kind.
  CameraModel camera;
  camera.width_px = colours.cols;
  camera.height_px = colours.rows;
  camera.fx_px = camera.fy_px = 1600;
  camera.cx_px = 0.5 * (colours.cols - 1);
  camera.cy_px = 0.5 * (colours.rows - 1);
  TargetDescription target;
  target.family = TagFamily::aruco_4x4_50;
  target.tags = {{0, {}}, {1, {}}, {2, {}}, {3, {}}};
  Subsets subsets(camera, target, {.frames = 1},
                  {{0, 1, 2, 3}, {0, 1}, {2, 3}, {0, 3}, {1, 2}, {0, 1, 2}, {1, 2, 3}});
  int number = 0;
  do {
    cv::cvtColor(colours, grey, cv::COLOR_BGR2GRAY);
    Frame frame;
    frame.image = {grey.data, grey.cols, grey.rows, static_cast<int>(grey.step)};
    frame.capture_time = frame.latency_origin =
        TimePoint(Duration(std::llround(1e9 * number / 30.0)));
    frame.sequence = static_cast<std::uint64_t>(number++);
    subsets.add(frame);
  } while (video.read(colours));
  ASSERT_GT(number, 200);
  const std::vector<Subsets::Result> results = subsets.adjusted();
  expect_agreement(results);
  for (const Subsets::Result& result : results)
    EXPECT_NE(result.complaint.find("hardly moved"), std::string::npos) << result.complaint;
}

}  // namespace
}  // namespace tagwrench
