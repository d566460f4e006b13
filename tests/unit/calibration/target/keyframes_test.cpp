#include <gtest/gtest.h>

#include "host/calibration/target/recorder.h"
#include "host/tracker/camera_model.h"

namespace tagwrench {
namespace {

class Crop : public testing::Test {
 protected:
  Crop() : pixels_(static_cast<std::size_t>(stride_) * 480) {
    for (std::size_t i = 0; i < pixels_.size(); ++i)
      pixels_[i] = static_cast<std::uint8_t>(i % 251);
  }
  // The pixel of the image after flipping back.
  std::uint8_t level(int column, int row) const {
    const int raw = camera_.mirrored ? 640 - 1 - column : column;
    return pixels_[static_cast<std::size_t>(row * stride_ + raw)];
  }

  int stride_ = 700;
  std::vector<std::uint8_t> pixels_;
  CameraModel camera_;
};

TEST_F(Crop, ShowsTheSamePixelsAtTheSameProjection) {
  const std::vector<Eigen::Vector3d> points = {{1e-3, 0.5e-3, 21e-3}, {3e-3, 2e-3, 20e-3}};
  for (const bool mirrored : {false, true}) {
    camera_.mirrored = mirrored;
    const Keyframe frame = cropped({pixels_.data(), 640, 480, stride_}, camera_, points);
    ASSERT_FALSE(frame.pixels.empty());
    EXPECT_LT(frame.camera.width_px, 150);
    EXPECT_FALSE(frame.camera.mirrored);
    const int x0 = static_cast<int>(camera_.cx_px - frame.camera.cx_px);
    const int y0 = static_cast<int>(camera_.cy_px - frame.camera.cy_px);
    for (int row = 0; row < frame.camera.height_px; ++row) {
      for (int column = 0; column < frame.camera.width_px; ++column) {
        ASSERT_EQ(frame.pixels[static_cast<std::size_t>(row * frame.camera.width_px + column)],
                  level(x0 + column, y0 + row));
      }
    }
    for (const Eigen::Vector3d& p : points) {
      const Eigen::Vector2d whole = project(camera_, p).pixel;
      const Eigen::Vector2d part = project(frame.camera, p).pixel;
      EXPECT_LT((whole - part - Eigen::Vector2d(x0, y0)).norm(), 1e-9);  // px
    }
  }
}

TEST_F(Crop, StaysInsideTheImage) {
  const Keyframe frame = cropped({pixels_.data(), 640, 480, stride_}, camera_,
                                 {{-8e-3, -6e-3, 21e-3}, {30e-3, 0, 21e-3}});
  EXPECT_LE(frame.camera.width_px, 640);
  EXPECT_EQ(frame.camera.cx_px, camera_.cx_px);
  EXPECT_TRUE(
      cropped({pixels_.data(), 640, 480, stride_}, camera_, {{0, 0, -21e-3}}).pixels.empty());
  EXPECT_TRUE(
      cropped({pixels_.data(), 640, 480, stride_}, camera_, {{1.0, 0, 21e-3}}).pixels.empty());
}

TEST(KeyframeSet, StaysSmallAndKeepsTheWholeRange) {
  KeyframeSet set(40);
  for (int i = 0; i < 3000; ++i) {
    Keyframe frame;
    frame.displacement[2] = 1e-3 * i / 3000;  // m
    if (set.wants(frame.displacement)) set.add(frame);
  }
  EXPECT_LE(set.frames().size(), 40u);
  EXPECT_GE(set.frames().size(), 20u);
  EXPECT_LT(set.frames().front().displacement[2], 0.05e-3);
  EXPECT_GT(set.frames().back().displacement[2], 0.95e-3);
}

TEST(KeyframeSet, WantsNoPictureTwice) {
  KeyframeSet set(40);
  set.add({});
  EXPECT_FALSE(set.wants(Vector6::Zero()));
}

}  // namespace
}  // namespace tagwrench
