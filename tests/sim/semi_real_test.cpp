// The tracker on the real picture, set in motion: real ink, light, blur and JPEG blocks.
#include "tests/support/semi_real.h"

#include <gtest/gtest.h>

#include <cmath>
#include <memory>

#include "host/sensor/sensor_config.h"
#include "host/tracker/tracker.h"
#include "tests/support/after_fit.h"

namespace tagwrench::test {
namespace {

constexpr int kRestFrames = 25;
constexpr int kFrames = kRestFrames + 300;

struct Case {
  const char* name;
  int jpeg_quality;
};

class SemiRealSequence : public testing::TestWithParam<Case> {
 protected:
  void SetUp() override {
    const auto picture = real_picture();
    if (!picture)
      GTEST_SKIP() << "TAGWRENCH_DATA is not set; it names the folder with the real recordings";
    options_.jpeg_quality = GetParam().jpeg_quality;
    renderer_ = std::make_unique<SemiReal>(*picture, options_);
  }

  SemiRealOptions options_;
  std::unique_ptr<SemiReal> renderer_;
};

TEST_P(SemiRealSequence, BothTagsAreHeldAndTheErrorAfterTheFitIsSmall) {
  const SensorConfig sensor = parse_sensor(renderer_->sensor_yaml(false), "semi-real");
  Tracker tracker(sensor.camera, sensor.target, sensor.rest);
  std::vector<Vector6> readings, truths;
  for (int i = 0; i < kFrames; ++i) {
    const Vector6 truth = renderer_->displacement(i);
    const cv::Mat picture = renderer_->picture(truth, static_cast<std::uint64_t>(i));
    Frame frame;
    frame.image = {picture.data, picture.cols, picture.rows, static_cast<int>(picture.step)};
    frame.capture_time = frame.latency_origin =
        TimePoint(Duration(std::llround(1e9 * i / options_.frame_rate)));
    frame.sequence = static_cast<std::uint64_t>(i);
    const Track track = tracker.track(frame);
    if (i < kRestFrames) continue;
    ASSERT_EQ(track.status, Status::ok) << "frame " << i;
    ASSERT_EQ(track.tags_held, 2) << "frame " << i;
    readings.push_back(track.displacement);
    truths.push_back(truth);
  }
  const Vector6 error = error_after_fit(readings, truths);
  EXPECT_LT(error[0], 0.15e-6);  // m
  EXPECT_LT(error[1], 0.15e-6);
  EXPECT_LT(error[2], 0.6e-6);
  EXPECT_LT(error.tail<3>().maxCoeff(), 0.5e-3);  // rad
  std::printf("x %.3f y %.3f z %.3f um  rx %.3f ry %.3f rz %.3f mrad\n", 1e6 * error[0],
              1e6 * error[1], 1e6 * error[2], 1e3 * error[3], 1e3 * error[4], 1e3 * error[5]);
}

TEST_P(SemiRealSequence, TheRealPictureIsUntouchedAtRest) {
  const cv::Mat light = renderer_->light(Vector6::Zero());
  const cv::Mat again = renderer_->picture(Vector6::Zero(), 7);
  double sum = 0, off_levels = 0;
  int count = 0;
  for (int y = 100; y < 380; ++y) {
    for (int x = 100; x < 400; ++x, ++count) {
      // Whole levels of the file come back from the interpolation.
      const double off = light.at<float>(y, x) - std::round(light.at<float>(y, x));
      off_levels += off * off;
      sum += std::pow(again.at<std::uint8_t>(y, x) - light.at<float>(y, x), 2);
    }
  }
  EXPECT_LT(std::sqrt(off_levels / count), 0.01);  // grey levels
  const double added = std::sqrt(sum / count);     // grey levels
  EXPECT_LT(added, options_.noise_counts + 0.6);
  EXPECT_GT(added, options_.noise_counts - 0.6);  // JPEG rounds some noise off
}

INSTANTIATE_TEST_SUITE_P(Sequences, SemiRealSequence,
                         testing::Values(Case{"AsItIs", 0}, Case{"Jpeg85", 85}),
                         [](const auto& param) { return std::string(param.param.name); });

}  // namespace
}  // namespace tagwrench::test
