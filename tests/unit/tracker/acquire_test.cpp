// Tags in a part of the image: where they were a moment ago.
#include "host/tracker/acquire.h"

#include <gtest/gtest.h>

#include "host/tracker/tracker.h"
#include "tests/unit/tracker/render.h"
#include "tests/unit/tracker/template_scene.h"

namespace tagwrench {
namespace {

TargetDescription five_and_two() {
  TargetDescription target;
  target.family = TagFamily::aruco_original;
  target.tags = {{5, {}}, {2, {}}};
  return target;
}

render::Picture picture_of(const render::Scene& scene,
                           const Vector6& displacement = Vector6::Zero()) {
  std::mt19937 random(3);
  return render::take(scene, displacement, random);
}

/// The smallest part with all tags in it, as delivered, and `margin_px` around.
Region around(const Finding& finding, const CameraModel& camera, int margin_px) {
  Eigen::AlignedBox2d box;
  for (const FoundTag& tag : finding.tags) {
    for (Eigen::Vector2d corner : tag.corners_px) {
      if (camera.mirrored) corner.x() = camera.width_px - 1 - corner.x();
      box.extend(corner);
    }
  }
  const Eigen::Vector2i first = box.min().cast<int>() - Eigen::Vector2i::Constant(margin_px);
  const Eigen::Vector2i past = box.max().cast<int>() + Eigen::Vector2i::Constant(margin_px);
  return {first.x(), first.y(), past.x() - first.x(), past.y() - first.y()};
}

void expect_the_same_tags_in_a_part(const render::Scene& scene) {
  Vector6 displacement = Vector6::Zero();
  displacement.x() = 1e-3;  // m, so that no middle is a middle of the image
  const render::Picture picture = picture_of(scene, displacement);
  const CameraModel camera = render::camera_of(scene);
  Acquirer acquirer(camera, five_and_two());
  const Finding whole = acquirer.find(picture.view());
  ASSERT_EQ(whole.tags.size(), 2U);
  const Finding part = acquirer.find_in(picture.view(), around(whole, camera, 40));
  ASSERT_EQ(part.tags.size(), 2U);
  for (std::size_t t = 0; t < 2; ++t) {
    ASSERT_EQ(part.tags[t].index, whole.tags[t].index);
    for (std::size_t c = 0; c < 4; ++c)
      EXPECT_LT((part.tags[t].corners_px[c] - whole.tags[t].corners_px[c]).norm(), 0.5) << "px";
    ASSERT_FALSE(part.tags[t].camera_T_tag.empty());
    EXPECT_LT(
        (part.tags[t].camera_T_tag[0].translation() - whole.tags[t].camera_T_tag[0].translation())
            .norm(),
        0.2e-3)
        << "m";
  }
}

TEST(AcquireInAPart, FindsTagsInPixelsOfTheWholeImage) {
  expect_the_same_tags_in_a_part(render::roof());
}

TEST(AcquireInAPart, FindsTagsOfAMirroredCamera) {
  render::Scene scene = render::roof();
  scene.mirrored = true;
  expect_the_same_tags_in_a_part(scene);
}

TEST(AcquireInAPart, TakesWhatLiesWithinTheImage) {
  const render::Scene scene = render::roof();
  const render::Picture picture = picture_of(scene);
  Acquirer acquirer(render::camera_of(scene), five_and_two());
  EXPECT_EQ(acquirer.find_in(picture.view(), {-300, -200, 1200, 900}).tags.size(), 2U);
  EXPECT_TRUE(acquirer.find_in(picture.view(), {0, 0, 40, 40}).tags.empty());
}

/// A tag twice in the whole image cannot be told from its double: who is found then was looked for
/// where it was.
class SeenLately : public ::testing::Test {
 protected:
  static constexpr int kRestFrames = 25;

  SeenLately() : tracker_(render::camera_of(scene_), five_and_two(), {kRestFrames, {}, {}}) {
    for (int i = 0; i < kRestFrames; ++i) show(rest_, i);
  }

  Track show(const render::Picture& picture, double periods) {
    Frame frame;
    frame.image = picture.view();
    frame.sequence = sequence_++;
    frame.capture_time = TimePoint{} + std::chrono::microseconds(std::llround(40e3 * periods));
    return tracker_.track(frame);
  }

  /// The upper tag of `picture` once more, half as large, in the upper left corner.
  render::Picture with_double(render::Picture picture) const {
    constexpr int kLeft = 240, kTop = 60, kSide = 180;  // px, with both the tag and white around
    for (int row = 0; row < kSide / 2; ++row) {
      for (int column = 0; column < kSide / 2; ++column) {
        const int from = (kTop + 2 * row) * picture.width + kLeft + 2 * column;
        picture.pixels[static_cast<std::size_t>(row * picture.width + column)] =
            picture.pixels[static_cast<std::size_t>(from)];
      }
    }
    return picture;
  }

  render::Scene scene_ = render::roof();
  render::Picture rest_ = picture_of(scene_);
  render::Picture blank_{640, 480, std::vector<std::uint8_t>(640 * 480, 90)};
  Tracker tracker_;
  std::uint64_t sequence_ = 0;
};

TEST_F(SeenLately, TagsAreLookedForWhereTheyWere) {
  const render::Picture doubled = with_double(rest_);
  Acquirer acquirer(render::camera_of(scene_), five_and_two());
  ASSERT_EQ(acquirer.find(doubled.view()).twice.size(), 1U) << "the double must be one";
  EXPECT_EQ(show(blank_, 25).status, Status::lost);
  EXPECT_EQ(show(doubled, 26).tags_held, 2);
}

TEST_F(SeenLately, FarFromThereTheyAreFoundInTheSameFrame) {
  EXPECT_EQ(show(blank_, 25).status, Status::lost);
  Vector6 far = Vector6::Zero();
  far.x() = 4e-3;  // m, 150 px
  const Track track = show(picture_of(scene_, far), 26);
  ASSERT_EQ(track.status, Status::ok);
  EXPECT_NEAR(track.displacement.x(), 4e-3, 20e-6) << "m";
}

}  // namespace
}  // namespace tagwrench
