// The vector code of pixel_sums.h against the same sums written out for one pixel after the other,
// in double precision, for every vector unit of this machine; and against numeric derivatives.
#include <gtest/gtest.h>
#include <hwy/targets.h>

#include <cmath>
#include <numeric>

#include "host/tracker/photometric.h"
#include "host/tracker/rotation.h"
#include "tests/unit/tracker/template_scene.h"

namespace tagwrench {
namespace {

using Columns = std::array<double, kPatchParameters>;

/// PatchView in double precision.
struct View {
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  Eigen::Matrix2d template_per_image = Eigen::Matrix2d::Identity();
  std::vector<double> gain;
  double offset = 0;
  std::array<double, 2> blur{};

  explicit View(const PatchView& v) : gain(v.gain.begin(), v.gain.end()), offset(v.offset) {
    for (int r = 0; r < 3; ++r) {
      for (int c = 0; c < 3; ++c)
        pose.linear()(r, c) = v.camera_R_platform[static_cast<std::size_t>(3 * r + c)];
      pose.translation()[r] = v.camera_t_platform[static_cast<std::size_t>(r)];
    }
    template_per_image << v.template_per_image[0], v.template_per_image[1], v.template_per_image[2],
        v.template_per_image[3];
    blur = {v.blur[0], v.blur[1]};
  }
};

struct Sums {
  Columns rhs{}, size{};  ///< sums, and the same of absolute values
  double squares = 0, weights = 0, inside = 0;
};

/// Where OpenCV's model has the point, px; written out anew.
Eigen::Vector2d seen(const CameraModel& c, const Eigen::Vector3d& p) {
  const double x = p.x() / p.z(), y = p.y() / p.z();
  const double r2 = x * x + y * y;
  const auto& k = c.distortion;
  const double radial = 1 + k[0] * r2 + k[1] * r2 * r2 + k[4] * r2 * r2 * r2;
  return {c.fx_px * (x * radial + 2 * k[2] * x * y + k[3] * (r2 + 2 * x * x)) + c.cx_px,
          c.fy_px * (y * radial + k[2] * (r2 + 2 * y * y) + 2 * k[3] * x * y) + c.cy_px};
}

/// One patch, its pixels compared with those that `pairs` names.
Sums sums_of(const PixelTemplate& t, const PixelPatch& patch, const View& view, double inverse_cut,
             const PixelPairs& pairs) {
  Sums sums;
  for (std::size_t i = patch.first; i < patch.first + patch.pixels; ++i) {
    const Eigen::Vector3d lever = view.pose.linear() * Eigen::Vector3d(t.x[i], t.y[i], t.z[i]);
    const Eigen::Vector3d p = lever + view.pose.translation();
    if (pairs.valid[i] == 0 || pairs.level[i] > 253.5F) continue;
    const Eigen::Vector2d d = view.template_per_image *
                              (Eigen::Vector2d(pairs.column[i], pairs.row[i]) - seen(t.camera, p));
    std::array<double, 10> c{};
    for (std::size_t k = 0; k < 10; ++k) c[k] = t.level[k][i];
    const double x = d.x(), y = d.y();
    const double blur = view.blur[0] + view.blur[1] * t.depth[i];
    const double laplacian =
        2 * (c[3] + c[5]) + 2 * x * (3 * c[6] + c[8]) + 2 * y * (c[7] + 3 * c[9]);
    const double expected = c[0] + c[1] * x + c[2] * y + c[3] * x * x + c[4] * x * y +
                            c[5] * y * y + c[6] * x * x * x + c[7] * x * x * y + c[8] * x * y * y +
                            c[9] * y * y * y + blur * laplacian +
                            0.5 * blur * blur * t.bilaplacian[i];
    const std::array<double, 4> over_the_tag = {1.0, t.across[i], t.down[i], t.down[i] * t.down[i]};
    double gain = 0;
    for (std::size_t k = 0; k < view.gain.size(); ++k) gain += view.gain[k] * over_the_tag[k];
    const double w = t.weight[i];
    const double r = w * (gain * pairs.level[i] + view.offset - expected);
    const double q = std::max(0.0, 1 - r * inverse_cut * r * inverse_cut);

    // d pixel / d point of a pinhole.
    Eigen::Matrix<double, 2, 3> projection;
    projection << t.camera.fx_px / p.z(), 0, -t.camera.fx_px * p.x() / (p.z() * p.z()),  //
        0, t.camera.fy_px / p.z(), -t.camera.fy_px * p.y() / (p.z() * p.z());
    const Eigen::RowVector2d gradient(c[1] + 2 * c[3] * x + c[4] * y,
                                      c[2] + c[4] * x + 2 * c[5] * y);
    const Eigen::RowVector3d shift = gradient * view.template_per_image * projection;
    const Eigen::RowVector3d turn = -shift * cross_matrix(lever);
    Columns column{shift[0], shift[1], shift[2],  turn[0],
                   turn[1],  turn[2],  laplacian, t.depth[i] * laplacian};
    for (std::size_t k = 0; k < view.gain.size(); ++k) column[8 + k] = c[0] * over_the_tag[k];
    column.back() = 1;
    for (std::size_t k = 0; k < column.size(); ++k) {
      sums.rhs[k] += q * q * w * column[k] * r;
      sums.size[k] += std::abs(q * q * w * column[k] * r);
    }
    sums.squares += q * q * r * r;
    sums.weights += q * q;
    sums.inside += 1;
  }
  return sums;
}

/// A view of all patches that differs from the template's in everything.
std::vector<PatchView> views_of(const PixelTemplate& t, const Eigen::Isometry3d& pose) {
  PatchView v;
  for (int r = 0; r < 3; ++r) {
    for (int c = 0; c < 3; ++c)
      v.camera_R_platform[static_cast<std::size_t>(3 * r + c)] =
          static_cast<float>(pose.linear()(r, c));
    v.camera_t_platform[static_cast<std::size_t>(r)] = static_cast<float>(pose.translation()[r]);
  }
  v.template_per_image = {1.02F, 0.03F, -0.04F, 0.97F};
  for (std::size_t k = 0; k < v.gain.size(); ++k)
    v.gain[k] = k == 0 ? 1.07F : 0.03F / static_cast<float>(k);
  v.offset = -6;
  v.blur = {0.11F, -0.04F};
  std::vector<PatchView> views(t.patches.size(), v);
  for (std::size_t n = 0; n < views.size(); ++n) views[n].offset += 0.1F * static_cast<float>(n);
  return views;
}

Eigen::Isometry3d a_little_off(const Eigen::Isometry3d& rest) {
  Vector6 motion;
  motion << 11e-6, -8e-6, 30e-6, 2e-3, -3e-3, 1e-3;
  return moved(rest, motion);
}

struct Case {
  const char* name;
  bool distorted = false, mirrored = false, cut = false, dazzled = false;
  float inverse_cut = 0;
};

class PixelSums : public testing::TestWithParam<Case> {
 protected:
  PixelSums() {
    render::Scene scene = render::roof();
    scene.mirrored = GetParam().mirrored;
    // All pixels: patches longer than one block of work.
    t_ = render::template_of(scene, {100'000, 1.0});
    pose_ = a_little_off(t_.camera_T_platform);
    if (GetParam().distorted) t_.camera.distortion = {-0.25, 0.1, 0.004, -0.003, 0.05};
    std::mt19937 random(4);
    picture_ = render::take(scene, Vector6::Zero(), random);
    if (GetParam().dazzled) {
      for (int row = 170; row < 230; ++row)
        std::fill_n(picture_.pixels.begin() + row * picture_.width + 290, 60, 255);
    }
    window_ = render::window(picture_);
    if (GetParam().cut)
      window_.left = 260, window_.top = 120, window_.right = 370, window_.bottom = 350;
    views_ = views_of(t_, pose_);
  }
  ~PixelSums() override { hwy::SetSupportedTargetsForTest(0); }

  std::vector<NormalEquations> run(bool keep, PixelPairs& pairs) const {
    std::vector<NormalEquations> sums(t_.patches.size());
    sum_patches(t_, window_, views_, GetParam().inverse_cut, keep, pairs, sums);
    return sums;
  }

  PixelTemplate t_;
  Eigen::Isometry3d pose_;
  render::Picture picture_;
  PixelWindow window_;
  std::vector<PatchView> views_;
};

/// Of the sum of absolute values, all patches together; a single patch may be off by twice that,
/// for a pixel's place is rounded to 3e-5 px.
constexpr double kRelative = 1e-4;

void expect_equal(const std::vector<NormalEquations>& is, const std::vector<Sums>& should) {
  Columns total{}, size{};
  double rounding = 0;
  for (const Sums& s : should) {
    for (std::size_t k = 0; k < kPatchParameters; ++k) size[k] += s.size[k];
  }
  for (std::size_t n = 0; n < is.size(); ++n) {
    for (std::size_t k = 0; k < kPatchParameters; ++k) {
      const double off = is[n].rhs[k] - should[n].rhs[k];
      total[k] += off;
      rounding += std::abs(off);
      const double mean_size = size[k] / static_cast<double>(is.size());
      EXPECT_LE(std::abs(off), kRelative * (2 * should[n].size[k] + mean_size))
          << "patch " << n << ", column " << k;
    }
    EXPECT_NEAR(is[n].squares, should[n].squares, 10 * kRelative * should[n].squares + 1e-3) << n;
    EXPECT_NEAR(is[n].weights, should[n].weights, kRelative * should[n].weights + 1e-3) << n;
    EXPECT_EQ(is[n].inside, should[n].inside) << n;
  }
  for (std::size_t k = 0; k < kPatchParameters; ++k)
    EXPECT_LE(std::abs(total[k]), kRelative * size[k]) << "column " << k;
  EXPECT_GT(rounding, 0) << "single precision never agrees to the last bit";
}

TEST_P(PixelSums, AreThoseOfPlainCodeOnEveryVectorUnit) {
  PixelPairs first(t_.size());
  int targets = 0;
  for (const auto target : hwy::SupportedAndGeneratedTargets()) {
    SCOPED_TRACE(hwy::TargetName(target));
    hwy::SetSupportedTargetsForTest(target);
    PixelPairs pairs(t_.size());
    const std::vector<NormalEquations> sums = run(false, pairs);
    if (targets++ == 0) first = pairs;
    std::vector<Sums> should, should_kept;
    for (std::size_t n = 0; n < t_.patches.size(); ++n) {
      should.push_back(sums_of(t_, t_.patches[n], View(views_[n]), GetParam().inverse_cut, pairs));
      should_kept.push_back(
          sums_of(t_, t_.patches[n], View(views_[n]), GetParam().inverse_cut, first));
    }
    expect_equal(sums, should);
    // The same pairs on every unit.
    PixelPairs kept = first;
    expect_equal(run(true, kept), should_kept);
    EXPECT_EQ(kept.column, first.column);
    EXPECT_EQ(kept.level, first.level);
  }
  EXPECT_GE(targets, 2) << "a scalar path, and a vector unit";
}

TEST_P(PixelSums, ComparesWithTheNearestPixelOfTheWindow) {
  constexpr double kRounding_px = 2e-4;
  PixelPairs pairs(t_.size());
  run(false, pairs);
  std::size_t outside = 0, dazzled = 0;
  for (const PixelPatch& patch : t_.patches) {
    for (std::size_t i = patch.first; i < patch.first + patch.pixels; ++i) {
      const Eigen::Vector2d at =
          seen(t_.camera, pose_ * Eigen::Vector3d(t_.x[i], t_.y[i], t_.z[i]));
      const bool inside = at.x() > window_.left - 0.5 && at.x() < window_.right - 0.5 &&
                          at.y() > window_.top - 0.5 && at.y() < window_.bottom - 0.5;
      ASSERT_EQ(pairs.valid[i] != 0, inside) << at.transpose();
      outside += inside ? 0 : 1;
      if (!inside) continue;
      ASSERT_LE(std::abs(pairs.column[i] - at.x()), 0.5 + kRounding_px);
      ASSERT_LE(std::abs(pairs.row[i] - at.y()), 0.5 + kRounding_px);
      const auto place =
          static_cast<std::size_t>(pairs.row[i]) * 640 + static_cast<std::size_t>(pairs.column[i]);
      ASSERT_EQ(pairs.level[i], picture_.pixels[place]);
      dazzled += pairs.level[i] == 255 ? 1 : 0;
    }
  }
  EXPECT_EQ(outside > 1000, GetParam().cut) << outside;
  EXPECT_EQ(dazzled > 1000, GetParam().dazzled) << dazzled;
}

INSTANTIATE_TEST_SUITE_P(
    All, PixelSums,
    testing::Values(Case{"Plain"}, Case{.name = "Weighted", .inverse_cut = 0.12F},
                    Case{.name = "Distorted", .distorted = true, .inverse_cut = 0.1F},
                    Case{.name = "Mirrored", .mirrored = true},
                    Case{.name = "PartlyOutOfView", .cut = true, .inverse_cut = 0.1F},
                    Case{.name = "Saturated", .dazzled = true},
                    Case{.name = "AllAtOnce",
                         .distorted = true,
                         .mirrored = true,
                         .cut = true,
                         .dazzled = true,
                         .inverse_cut = 0.08F}),
    [](const auto& param) { return std::string(param.param.name); });

TEST(PixelSumsTemplate, HasPaddingAndPatchesOfSeveralBlocks) {
  const PixelTemplate t = render::template_of(render::roof(), {100'000, 1.0});
  std::size_t padding = 0, longest = 0;
  for (const PixelPatch& patch : t.patches) {
    EXPECT_EQ(patch.count % kRun, 0U);
    padding += patch.count - patch.pixels;
    longest = std::max(longest, patch.count);
    for (std::size_t i = patch.first + patch.pixels; i < patch.first + patch.count; ++i)
      EXPECT_EQ(t.weight[i], 0);
  }
  EXPECT_GT(padding, 100U);
  EXPECT_GT(longest, 256U);
}

TEST(PixelSumsOfNothing, BehindTheLensOrWithoutAnImageAreZero) {
  const render::Scene scene = render::roof();
  const PixelTemplate t = render::template_of(scene);
  std::mt19937 random(4);
  const render::Picture picture = render::take(scene, Vector6::Zero(), random);
  Eigen::Isometry3d behind = t.camera_T_platform;
  behind.translation().z() = -0.02;
  PixelPairs pairs(t.size());
  std::vector<NormalEquations> sums(t.patches.size());
  const auto expect_nothing = [&](const PixelWindow& image, const Eigen::Isometry3d& pose) {
    sums.assign(t.patches.size(), {.rhs = {1}, .squares = 1, .weights = 1, .inside = 1});
    sum_patches(t, image, views_of(t, pose), 0, false, pairs, sums);
    for (const NormalEquations& s : sums) {
      for (const float sum : s.rhs) ASSERT_EQ(sum, 0);
      ASSERT_EQ(s.squares, 0);
      ASSERT_EQ(s.weights, 0);
      ASSERT_EQ(s.inside, 0);
    }
  };
  expect_nothing(render::window(picture), behind);
  expect_nothing({}, t.camera_T_platform);
  expect_nothing({picture.pixels.data(), 640, 300, 200, 300, 200}, t.camera_T_platform);
}

TEST(PixelSumsGradient, RightHandSideIsTheSlopeOfTheSquaredResiduals) {
  // The columns leave out the third order of the template and the distortion's part of the
  // Jacobian.
  constexpr double kOfTheSlope = 0.04;
  const render::Scene scene = render::roof();
  const PixelTemplate t = render::template_of(scene);
  std::mt19937 random(4);
  const render::Picture picture = render::take(scene, Vector6::Zero(), random);
  for (int axis = 0; axis < 6; ++axis) {
    Vector6 motion = Vector6::Zero();  // to have something to look at: about a third of a pixel
    motion[axis] = axis < 2 ? 8e-6 : axis == 2 ? 60e-6 : 4e-3;
    const Eigen::Isometry3d pose = moved(t.camera_T_platform, motion);
    std::vector<PatchView> views = views_of(t, pose);
    for (PatchView& v : views) {
      v.template_per_image = {1, 0, 0, 1};
      v.gain = {1};
      v.offset = 0;
      v.blur = {};
    }
    PixelPairs pairs(t.size());
    std::vector<NormalEquations> sums(t.patches.size());
    sum_patches(t, render::window(picture), views, 0, false, pairs, sums);
    double rhs = 0;
    for (const NormalEquations& s : sums) rhs += s.rhs[static_cast<std::size_t>(axis)];

    const auto squares = [&](double step) {
      Vector6 more = Vector6::Zero();
      more[axis] = step;
      double sum = 0;
      for (std::size_t n = 0; n < t.patches.size(); ++n) {
        View view(views[n]);
        view.pose = moved(pose, more);
        sum += sums_of(t, t.patches[n], view, 0, pairs).squares;
      }
      return sum;
    };
    const double step = 1e-2 * motion[axis];
    const double slope = (squares(step) - squares(-step)) / (4 * step);
    EXPECT_NEAR(rhs, slope, kOfTheSlope * std::abs(slope)) << "axis " << axis;
    EXPECT_GT(slope * motion[axis], 500) << "axis " << axis;
  }
}

}  // namespace
}  // namespace tagwrench
