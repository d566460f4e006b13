// Alignment to a picture of the target at rest, in light and shade.
#include "host/tracker/photometric.h"

#include <gtest/gtest.h>

#include <cmath>

#include "host/tracker/camera_model.h"
#include "host/tracker/rotation.h"
#include "tests/unit/tracker/template_scene.h"

namespace tagwrench {
namespace {

using render::Picture;
using render::Scene;

constexpr double kSigmas = 4;  // of six axes, several pictures: chance alone stays below

Vector6 motion_um_rad(double x_um, double y_um, double z_um, double rx, double ry, double rz) {
  Vector6 m;
  m << x_um * 1e-6, y_um * 1e-6, z_um * 1e-6, rx, ry, rz;
  return m;
}

/// A roof at rest and what looks at it.
struct Aligned {
  Scene scene = render::roof();
  PhotometricAligner aligner;
  Eigen::Isometry3d rest;
  PhotometricState state;
  std::mt19937 random{11};

  explicit Aligned(bool mirrored = false, double k1 = 0) {
    scene.mirrored = mirrored;
    scene.k1 = k1;
    scene.supersample = 8;
    rest = render::rest_pose(scene);
    aligner.set_template(render::template_of(scene));
  }
  PhotometricFit align(const Picture& picture) {
    return aligner.align(render::window(picture), rest, {}, state);
  }
  /// The rest picture with `change` applied to every pixel's light.
  template <class Change>
  Picture changed(const Change& change) {
    std::vector<float> light = render::expose(scene, Vector6::Zero());
    for (int row = 0; row < scene.height; ++row) {
      for (int column = 0; column < scene.width; ++column) {
        float& level = light[static_cast<std::size_t>(row * scene.width + column)];
        level = change(level, column, row);
      }
    }
    return render::develop(scene, light, random);
  }
  void expect_at_rest(const PhotometricFit& fit) const {
    ASSERT_TRUE(fit.converged);
    const Vector6 error = motion_between(rest, fit.camera_T_platform);
    for (int axis = 0; axis < 6; ++axis) {
      const double sigma = std::sqrt(fit.covariance(axis, axis));
      EXPECT_LT(std::abs(error[axis]), kSigmas * sigma) << "axis " << axis << ", sigma " << sigma;
    }
    // Sigmas that swallow anything prove nothing.
    EXPECT_LT(std::sqrt(fit.covariance(0, 0)), 0.1e-6);
    EXPECT_LT(std::sqrt(fit.covariance(2, 2)), 1e-6);
  }
};

struct Camera {
  const char* name;
  bool mirrored;
  double k1;
};

class Displaced : public testing::TestWithParam<Camera> {};

TEST_P(Displaced, IsFoundOnEveryAxis) {
  Aligned bench(GetParam().mirrored, GetParam().k1);
  // About half a pixel each, as prediction leaves it.
  for (const Vector6& truth :
       {motion_um_rad(15, 0, 0, 0, 0, 0), motion_um_rad(0, -15, 0, 0, 0, 0),
        motion_um_rad(0, 0, 120, 0, 0, 0), motion_um_rad(0, 0, 0, 0.008, 0, 0),
        motion_um_rad(0, 0, 0, 0, -0.008, 0), motion_um_rad(0, 0, 0, 0, 0, 0.008),
        motion_um_rad(-8, 7, -60, -0.004, 0.004, -0.004)}) {
    const PhotometricFit fit = bench.align(render::take(bench.scene, truth, bench.random));
    ASSERT_TRUE(fit.converged) << truth.transpose();
    EXPECT_EQ(fit.tags_held, 2);
    EXPECT_GT(fit.inlier_fraction, 0.95);
    const Vector6 error = motion_between(bench.rest, fit.camera_T_platform) - truth;
    // The tags' edges lie along the rows: what the template's polynomials leave does not average
    // out.
    for (int axis = 0; axis < 6; ++axis)
      EXPECT_LT(std::abs(error[axis]), axis < 2    ? 0.15e-6
                                       : axis == 2 ? 0.8e-6
                                                   : 0.22e-3)
          << "axis " << axis << " of " << truth.transpose();
  }
}

INSTANTIATE_TEST_SUITE_P(Cameras, Displaced,
                         testing::Values(Camera{"Plain", false, 0}, Camera{"Mirrored", true, 0},
                                         Camera{"Distorted", false, -0.25}),
                         [](const auto& param) { return std::string(param.param.name); });

TEST(Photometric, ResidualOfNothingButNoiseIsOne) {
  Aligned bench;
  const PhotometricFit fit = bench.align(render::take(bench.scene, Vector6::Zero(), bench.random));
  bench.expect_at_rest(fit);
  EXPECT_NEAR(fit.residual, 1.0, 0.05);
  EXPECT_NEAR(fit.inlier_fraction, 1.0, 0.02);
}

TEST(Photometric, LightStepLeavesThePoseWhereItIs) {
  Aligned bench;
  for (int i = 0; i < 3; ++i) {
    bench.expect_at_rest(
        bench.align(bench.changed([](float level, int, int) { return 0.6F * level + 20; })));
    EXPECT_NEAR(bench.state.illumination[0].gain[0] * 0.6, 1.0, 0.02);
    bench.expect_at_rest(bench.align(bench.changed([](float level, int, int) { return level; })));
    EXPECT_NEAR(bench.state.illumination[1].gain[0], 1.0, 0.02);
  }
}

TEST(Photometric, LightThatFallsOffAcrossTheTagsLeavesThePoseWhereItIs) {
  Aligned bench;
  bench.expect_at_rest(bench.align(bench.changed([](float level, int column, int row) {
    return level * (0.9F - 0.001F * static_cast<float>(column - 320) +
                    0.0005F * static_cast<float>(row - 240));
  })));
}

TEST(Photometric, ResidualsThatAreAlikeOverAPatchWidenTheSigmas) {
  constexpr int kDraws = 12;
  constexpr int kCell_px = 24;  // about a patch
  constexpr float kStain = 0.03F;
  Aligned bench;
  std::normal_distribution<float> normal;
  double squares = 0;
  for (int draw = 0; draw < kDraws; ++draw) {
    std::vector<float> stains(1000);
    for (float& stain : stains) stain = 1 + kStain * normal(bench.random);
    bench.state = {};
    const PhotometricFit fit = bench.align(bench.changed([&](float level, int column, int row) {
      return level * stains[static_cast<std::size_t>(row / kCell_px * 40 + column / kCell_px)];
    }));
    ASSERT_TRUE(fit.converged);
    const Vector6 error = motion_between(bench.rest, fit.camera_T_platform);
    squares += error.cwiseAbs2().cwiseQuotient(fit.covariance.diagonal()).sum();
  }
  const double mean = squares / (6 * kDraws);
  std::printf("(e/sigma)^2 %.2f\n", mean);
  EXPECT_LT(mean, 4);
  EXPECT_GT(mean, 0.2);
}

TEST(Photometric, ChangeOfFocusIsTakenForBlurAndNotForMotion) {
  constexpr double kBefore_px = 1.0, kAfter_px = 1.2;
  Aligned bench;
  bench.scene.blur_px = kAfter_px;
  const PhotometricFit fit = bench.align(render::take(bench.scene, Vector6::Zero(), bench.random));
  bench.expect_at_rest(fit);
  const double half_variance = 0.5 * (kAfter_px * kAfter_px - kBefore_px * kBefore_px);
  EXPECT_NEAR(bench.state.blur[0], half_variance, 0.05);
}

TEST(Photometric, CoveredThirdOfATagIsLeftOut) {
  Aligned bench;
  // The upper tag spans columns 245 to 400.
  const Picture picture = bench.changed(
      [](float level, int column, int row) { return row < 240 && column < 297 ? 90.0F : level; });
  const PhotometricFit fit = bench.align(picture);
  bench.expect_at_rest(fit);
  EXPECT_EQ(fit.tags_held, 2);
  EXPECT_LT(fit.inlier_fraction, 0.90);
  EXPECT_GT(fit.inlier_fraction, 0.70);
  EXPECT_LT(fit.residual, 1.2) << "what is covered must not count";
}

TEST(Photometric, GlareOnPartOfATagIsLeftOut) {
  Aligned bench;
  const PhotometricFit fit = bench.align(bench.changed([](float level, int column, int row) {
    return level + (column > 340 && row > 300 ? 200.0F : 0.0F);
  }));
  bench.expect_at_rest(fit);
  EXPECT_LT(fit.inlier_fraction, 0.95);
}

TEST(Photometric, WholeTagCoveredLeavesTheOther) {
  Aligned bench;
  const PhotometricFit fit = bench.align(
      bench.changed([](float level, int, int row) { return row > 245 ? 90.0F : level; }));
  ASSERT_TRUE(fit.converged);
  EXPECT_EQ(fit.tags_held, 1);
  EXPECT_NEAR(fit.inlier_fraction, 0.5, 0.1);
  const Vector6 error = motion_between(bench.rest, fit.camera_T_platform);
  for (int axis = 0; axis < 6; ++axis)
    EXPECT_LT(std::abs(error[axis]), kSigmas * std::sqrt(fit.covariance(axis, axis))) << axis;
}

TEST(Photometric, StateIsLeftAloneUnlessConverged) {
  Aligned bench;
  bench.align(bench.changed([](float level, int, int) { return 0.8F * level; }));
  const PhotometricState before = bench.state;
  ASSERT_NE(before.illumination[0].gain[0], 1.0);
  const auto expect_untouched = [&](const PhotometricFit& fit) {
    ASSERT_FALSE(fit.converged);
    for (std::size_t t = 0; t < 2; ++t) {
      EXPECT_EQ(bench.state.illumination[t].gain, before.illumination[t].gain);
      EXPECT_EQ(bench.state.illumination[t].offset, before.illumination[t].offset);
    }
    EXPECT_EQ(bench.state.blur, before.blur);
  };
  expect_untouched(bench.aligner.align({}, bench.rest, {}, bench.state));
  // 10 px away there is nothing that alignment could climb.
  const Picture picture = render::take(bench.scene, Vector6::Zero(), bench.random);
  expect_untouched(bench.aligner.align(render::window(picture),
                                       moved(bench.rest, motion_um_rad(500, 400, 0, 0, 0, 0.3)), {},
                                       bench.state));
}

TEST(Photometric, RegionCoversTheTagsAndTheMarginAndNotMuchMore) {
  constexpr double kSlack_px = 12;
  Aligned bench;
  for (const Vector6& motion :
       {Vector6(Vector6::Zero()), motion_um_rad(500, -300, -800, 0.03, 0, 0.1)}) {
    const Eigen::Isometry3d pose = moved(bench.rest, motion);
    double left = 1e9, top = 1e9, right = -1e9, bottom = -1e9;
    for (const render::PrintedTag& tag : bench.scene.tags) {
      for (int corner = 0; corner < 4; ++corner) {
        const Eigen::Vector3d on_tag((corner & 1 ? 0.5 : -0.5) * tag.size,
                                     (corner & 2 ? 0.5 : -0.5) * tag.size, 0);
        const Eigen::Vector2d at =
            project(CameraModel{}, pose * bench.rest.inverse() * tag.camera_T_tag * on_tag).pixel;
        left = std::min(left, at.x());
        right = std::max(right, at.x());
        top = std::min(top, at.y());
        bottom = std::max(bottom, at.y());
      }
    }
    constexpr int kMargin_px = 20;
    const Region region = bench.aligner.region(pose, kMargin_px);
    EXPECT_LE(region.x, left - kMargin_px);
    EXPECT_LE(region.y, top - kMargin_px);
    EXPECT_GE(region.x + region.width, right + kMargin_px);
    EXPECT_GE(region.y + region.height, bottom + kMargin_px);
    // The white margin of the paper counts too: 13 px.
    EXPECT_GE(region.x, left - kMargin_px - 15 - kSlack_px);
    EXPECT_LE(region.y + region.height, bottom + kMargin_px + 15 + kSlack_px);
  }
  // Never beyond the image.
  const Region all = bench.aligner.region(bench.rest, 1000);
  EXPECT_EQ(all, (Region{0, 0, 640, 480}));
}

TEST(Photometric, MotionOfShiftsIsTheMotionThatMakesThem) {
  Aligned bench;
  const PixelTemplate& t = bench.aligner.pixels();
  const Vector6 truth = motion_um_rad(3, -2, 10, 4e-4, -3e-4, 5e-4);
  std::vector<Eigen::Vector2d> shifts;
  for (const PixelPatch& patch : t.patches) {
    shifts.push_back(project(t.camera, moved(bench.rest, truth) * patch.middle).pixel -
                     project(t.camera, bench.rest * patch.middle).pixel);
  }
  const Vector6 motion = bench.aligner.motion_of(bench.rest, shifts);
  for (int axis = 0; axis < 6; ++axis)
    EXPECT_NEAR(motion[axis], truth[axis], 0.01 * std::abs(truth[axis])) << axis;
}

}  // namespace
}  // namespace tagwrench
