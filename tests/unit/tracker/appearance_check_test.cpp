// A loaded picture must show the target where its poses say.
#include <gtest/gtest.h>

#include <algorithm>
#include <utility>

#include "host/tracker/reference.h"
#include "tests/unit/tracker/template_scene.h"

namespace tagwrench {
namespace {

struct Loaded {
  CameraModel camera;
  TargetDescription target;
  ReferenceOptions rest;
};

Loaded loaded(const render::Scene& scene) {
  Loaded all{render::camera_of(scene), {}, {}};
  for (std::size_t t = 0; t < 2; ++t)
    all.target.tags[t].platform_T_tag =
        render::rest_pose(scene).inverse() * scene.tags[t].camera_T_tag;
  all.rest.camera_T_platform = render::rest_pose(scene);
  all.rest.appearance = ReferenceImage{scene.width, scene.height, 25, render::rest_picture(scene)};
  return all;
}

std::optional<AppearanceMismatch> mismatch(const Loaded& all) {
  return check_appearance(all.camera, all.target, all.rest);
}

TEST(AppearanceCheck, ThePictureOfTheTargetFits) {
  render::Scene scene = render::roof();
  EXPECT_FALSE(mismatch(loaded(scene)));
  scene.mirrored = true;
  EXPECT_FALSE(mismatch(loaded(scene)));
  scene.mirrored = false;
  scene.blur_px = 5;
  scene.k1 = -0.2;
  EXPECT_FALSE(mismatch(loaded(scene)));
}

TEST(AppearanceCheck, UnevenLightAndGlareInACornerFit) {
  Loaded all = loaded(render::roof());
  const int width = all.rest.appearance->width;
  for (int i = 0; i < static_cast<int>(all.rest.appearance->level.size()); ++i) {
    const int x = i % width;
    float& level = all.rest.appearance->level[static_cast<std::size_t>(i)];
    level *= 1.0F - 0.6F * static_cast<float>(x) / static_cast<float>(width);
    if (x < 280 && i / width < 150) level = 255;
  }
  EXPECT_FALSE(mismatch(all));
}

TEST(AppearanceCheck, AFlatPictureFitsNothing) {
  Loaded all = loaded(render::roof());
  for (const float level : {0.0F, 128.0F, 255.0F}) {
    std::fill(all.rest.appearance->level.begin(), all.rest.appearance->level.end(), level);
    ASSERT_TRUE(mismatch(all)) << level;
    EXPECT_EQ(mismatch(all)->id, 5);
    EXPECT_EQ(mismatch(all)->likeness, 0);
  }
}

TEST(AppearanceCheck, SwappedTagsAreNoticed) {
  Loaded all = loaded(render::roof());
  std::swap(all.target.tags[0].id, all.target.tags[1].id);
  ASSERT_TRUE(mismatch(all));
  EXPECT_EQ(mismatch(all)->id, 2);
}

TEST(AppearanceCheck, OneForeignTagIsNamed) {
  Loaded all = loaded(render::roof());
  all.target.tags[1].id = 7;
  ASSERT_TRUE(mismatch(all));
  EXPECT_EQ(mismatch(all)->id, 7);
}

TEST(AppearanceCheck, ATagOutsideThePictureIsNoticed) {
  Loaded all = loaded(render::roof());
  all.rest.camera_T_platform->translation().x() += 10e-3;
  EXPECT_TRUE(mismatch(all));
}

TEST(AppearanceCheck, WithoutPlacesOrPictureNothingIsSaid) {
  Loaded all = loaded(render::roof());
  std::swap(all.target.tags[0].id, all.target.tags[1].id);
  Loaded unplaced = all;
  for (Tag& tag : unplaced.target.tags) tag.platform_T_tag.reset();
  EXPECT_FALSE(mismatch(unplaced));
  all.rest.appearance.reset();
  EXPECT_FALSE(mismatch(all));
}

}  // namespace
}  // namespace tagwrench
