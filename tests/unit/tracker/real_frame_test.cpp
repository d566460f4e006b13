// One real frame of the real sensor, shown again and again. The data stay outside the project:
// TAGWRENCH_DATA.
#include <gtest/gtest.h>

#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <opencv2/imgcodecs.hpp>
#include <string>

#include "host/tracker/tracker.h"

namespace tagwrench {
namespace {

class RealFrame : public testing::Test {
 protected:
  void SetUp() override {
    const char* data = std::getenv("TAGWRENCH_DATA");
    if (data == nullptr) GTEST_SKIP() << "TAGWRENCH_DATA is not set: no recorded frame to read";
    const std::string path =
        std::string(data) + "/icra2020/2019-09-13_120207_first_frame_640x480.jpg";
    image_ = cv::imread(path, cv::IMREAD_GRAYSCALE);
    if (image_.empty()) GTEST_SKIP() << "no image at " << path;
  }

  /// The frame as the n-th of a stream at 25 frames a second.
  Frame frame(int n) const {
    Frame frame;
    frame.image = {image_.data, image_.cols, image_.rows, static_cast<int>(image_.step)};
    frame.capture_time = TimePoint{} + std::chrono::milliseconds(40) * n;
    return frame;
  }

  cv::Mat image_;
};

TEST_F(RealFrame, IsTrackedWithBothTags) {
  CameraModel camera;
  camera.mirrored = true;
  Tracker tracker(camera, TargetDescription{}, ReferenceOptions{});
  for (int i = 0; i < 60; ++i) {
    const Track track = tracker.track(frame(i));
    if (i < 24) continue;
    if (i == 24) {
      EXPECT_EQ(track.diagnostic, Diagnostic::rest_learned);
      continue;
    }
    ASSERT_EQ(track.status, Status::ok) << i;
    EXPECT_EQ(track.tags_held, 2);
    // The frame at rest itself: rest was learned from its average.
    EXPECT_LT(track.displacement.head<3>().norm(), 0.5e-6);
    EXPECT_LT(track.displacement.tail<3>().norm(), 0.5e-3);
    EXPECT_LT(track.residual_px, 0.2);
  }
}

TEST_F(RealFrame, UnflippedIsSaidToLookMirrored) {
  Tracker tracker(CameraModel{}, TargetDescription{}, ReferenceOptions{});
  int diagnostics = 0;
  for (int i = 0; i < 8; ++i) {
    const Track track = tracker.track(frame(i));
    EXPECT_EQ(track.status, Status::acquiring);
    diagnostics += track.diagnostic == Diagnostic::image_looks_mirrored ? 1 : 0;
  }
  EXPECT_GE(diagnostics, 1);
}

}  // namespace
}  // namespace tagwrench
