// The width of a tag's edges beside the blur that another renderer put there.
#include <gtest/gtest.h>

#include "host/tracker/acquire.h"
#include "host/tracker/picture_quality.h"
#include "tests/unit/tracker/render.h"

namespace tagwrench {
namespace {

constexpr double kTolerance = 0.06;

struct Shot {
  render::Picture picture;
  Finding finding;
  std::vector<TagPattern> patterns;
};

Shot shot(render::Scene scene) {
  std::mt19937 random(3);
  Shot out;
  out.picture = render::develop(scene, render::expose(scene, Vector6::Zero()), random);
  CameraModel camera;
  camera.mirrored = scene.mirrored;
  Acquirer acquirer(camera, TargetDescription{});
  out.finding = acquirer.find(out.picture.view());
  out.patterns = acquirer.patterns();
  return out;
}

std::vector<EdgeWidth> widths(const Shot& shot, double corner_error_px = 0) {
  std::vector<EdgeWidth> out;
  for (const FoundTag& tag : shot.finding.tags) {
    Square corners = tag.corners_px;
    corners[0].x() += corner_error_px;
    corners[2].y() += corner_error_px;
    const auto width = edge_width(shot.picture.view(), shot.patterns[tag.index], corners);
    if (width) out.push_back(*width);
  }
  return out;
}

TEST(EdgeWidth, IsTheBlurOfThePicture) {
  for (const double blur : {0.8, 1.5, 2.5, 4.0, 5.5}) {
    render::Scene scene = render::roof();
    scene.blur_px = blur;
    const std::vector<EdgeWidth> found = widths(shot(scene));
    ASSERT_EQ(found.size(), 2u) << blur << " px";
    for (const EdgeWidth& width : found) {
      EXPECT_NEAR(width.blur_px / blur, 1, kTolerance) << blur << " px";
      EXPECT_LT(width.residual_fraction, 0.1);
    }
  }
}

TEST(EdgeWidth, DoesNotTakeAnEdgeOutOfPlaceForAWideOne) {
  render::Scene scene = render::roof();
  scene.blur_px = 1.5;
  const Shot taken = shot(scene);
  const std::vector<EdgeWidth> exact = widths(taken), off = widths(taken, 3);
  ASSERT_EQ(exact.size(), 2u);
  ASSERT_EQ(off.size(), 2u);
  for (std::size_t i = 0; i < 2; ++i) {
    EXPECT_NEAR(off[i].blur_px, exact[i].blur_px, 0.02);
    EXPECT_LT((off[i].corners_px[0] - exact[i].corners_px[0]).norm(), 0.05);
  }
}

TEST(EdgeWidth, CornersMayGoRoundEitherWay) {
  render::Scene scene = render::roof();
  scene.mirrored = true;
  scene.blur_px = 1.5;
  Shot taken = shot(scene);
  for (FoundTag& tag : taken.finding.tags) {
    for (Eigen::Vector2d& corner : tag.corners_px) corner.x() = scene.width - 1 - corner.x();
  }
  const std::vector<EdgeWidth> found = widths(taken);
  ASSERT_EQ(found.size(), 2u);
  for (const EdgeWidth& width : found) EXPECT_NEAR(width.blur_px / scene.blur_px, 1, kTolerance);
}

TEST(EdgeWidth, LightThatIsCutOffDoesNotSharpen) {
  render::Scene scene = render::roof();
  scene.blur_px = 2;
  Shot taken = shot(scene);
  for (std::uint8_t& level : taken.picture.pixels)
    level = static_cast<std::uint8_t>(std::min(255.0, 1.4 * level));
  const std::vector<EdgeWidth> found = widths(taken);
  ASSERT_EQ(found.size(), 2u);
  for (const EdgeWidth& width : found) {
    EXPECT_GT(width.white_fraction, 0.1);
    EXPECT_NEAR(width.blur_px / scene.blur_px, 1, 0.15);
  }
}

TEST(EdgeWidth, IsNoneWhereThereIsNoSuchTag) {
  render::Scene scene = render::roof();
  const Shot taken = shot(scene);
  ASSERT_EQ(taken.finding.tags.size(), 2u);
  const Square& here = taken.finding.tags[0].corners_px;
  const ImageView image = taken.picture.view();
  EXPECT_FALSE(edge_width(image, taken.patterns[1], here)) << "another tag's cells";
  Square aside = here;
  for (Eigen::Vector2d& corner : aside) corner.x() -= 60;
  EXPECT_FALSE(edge_width(image, taken.patterns[0], aside));
  for (Eigen::Vector2d& corner : aside) corner.x() -= 1e5;
  EXPECT_FALSE(edge_width(image, taken.patterns[0], aside)) << "out of the image";
  aside.fill(here[0]);
  EXPECT_FALSE(edge_width(image, taken.patterns[0], aside)) << "no square";
  const std::vector<std::uint8_t> grey(640 * 480, 120);
  EXPECT_FALSE(edge_width({grey.data(), 640, 480, 640}, taken.patterns[0], here)) << "even grey";
}

}  // namespace
}  // namespace tagwrench
