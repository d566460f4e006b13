// The design calculator: the published figures, and what a bound and springs must obey.
#include "host/tools/design/design.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace tagwrench::study {
namespace {

constexpr double kDegrees = 180 / std::numbers::pi;

/// A chequered tag of 6 x 6 cells, facing the camera at 20 mm if `tilt` (rad about x) is 0.
SeenTag chequers(double tilt, double y = 0) {
  SeenTag tag;
  tag.camera_T_tag.linear() = Eigen::AngleAxisd(tilt, Eigen::Vector3d::UnitX()).toRotationMatrix();
  tag.camera_T_tag.translation() = Eigen::Vector3d(0, y, 20e-3);
  tag.size = 3e-3;
  tag.border = 0.5e-3;
  tag.cells = 6;
  for (int i = 0; i < 36; ++i) tag.white.push_back((i / 6 + i % 6) % 2 == 1 ? 1 : 0);
  return tag;
}

Vector6 sigma(const std::vector<SeenTag>& tags, const SeenPicture& picture) {
  return displacement_bound(tags, {0, 0, 20e-3}, picture).diagonal().cwiseSqrt();
}

Instrument instrument() {
  Instrument result;
  result.tags = {chequers(-0.8, -1.7e-3), chequers(0.8, 1.7e-3)};
  result.origin = {0, 0, 20e-3};
  Spring spring;
  spring.rate = 700;
  spring.coils = 20;
  for (const double x : {-7e-3, 7e-3}) {
    for (const double y : {-7e-3, 7e-3}) {
      spring.top = {x, y, 0};
      result.springs.push_back(spring);
    }
  }
  // Elastic centre at the origin: no cross terms.
  result.stiffness = (Vector6() << 280, 280, 2800, 0.14, 0.14, 0.03).finished().asDiagonal();
  result.platform.centre_of_mass.setZero();
  return result;
}

TEST(PublishedDesign, BitsAreThePaperS) {
  const CountedSteps steps = counted_steps({});
  EXPECT_EQ(steps.bits_y, 10);
  EXPECT_EQ(steps.bits_x, 11);
  EXPECT_EQ(steps.bits_z, 10) << "as y, whatever was printed";
}

TEST(PublishedDesign, StepsAreThePaperS) {
  const CountedSteps steps = counted_steps({});
  EXPECT_NEAR(1e6 * steps.step_xy, 7.5, 0.005);  // um
  EXPECT_NEAR(1e3 * steps.step_z, 0.07, 0.005);  // mm
  EXPECT_NEAR(steps.chord_px, 81.18, 0.005);     // px
  EXPECT_NEAR(kDegrees * steps.step_rz, 0.139, 0.0005);
  EXPECT_NEAR(steps.foreshortening_px, 21.97, 0.005);
  EXPECT_NEAR(kDegrees * steps.step_rxy, 0.51, 0.005);
}

TEST(PublishedDesign, ForcesAreThePaperS) {
  const CountedPixels design;
  const auto y = [&](double range) {
    return counted_force(range, design.travel_y_px(), design.counts_per_px);
  };
  const auto x = [&](double range) {
    return counted_force(range, design.travel_x_px(), design.counts_per_px);
  };
  EXPECT_NEAR(1e3 * y(1), 2.1, 0.05);  // mN
  EXPECT_NEAR(1e3 * x(1), 1.0, 0.05);  // mN
  EXPECT_NEAR(y(40), 0.083, 0.0005);   // N
  EXPECT_NEAR(x(40), 0.041, 0.0005);   // N
}

TEST(PublishedDesign, FinerCountsGiveMoreBitsAndSmallerSteps) {
  CountedPixels fine;
  fine.counts_per_px = 8;
  EXPECT_EQ(counted_steps(fine).bits_x, 12);
  EXPECT_LT(counted_steps(fine).step_z, 0.51 * counted_steps({}).step_z);
}

TEST(DisplacementBound, GoesWithNoiseOverContrast) {
  SeenPicture picture;
  const std::vector<SeenTag> tags{chequers(0.5)};
  const Vector6 before = sigma(tags, picture);
  picture.noise_counts *= 3;
  EXPECT_TRUE(sigma(tags, picture).isApprox(3 * before, 1e-9));
  picture.contrast_counts *= 3;
  EXPECT_TRUE(sigma(tags, picture).isApprox(before, 1e-9));
}

TEST(DisplacementBound, GoesWithTheRootOfBlur) {
  SeenPicture picture;
  picture.blur_px = std::sqrt(1 - 1.0 / 12);
  const std::vector<SeenTag> tags{chequers(0.5), chequers(-0.5, 4e-3)};
  const Vector6 sharp = sigma(tags, picture);
  picture.blur_px = std::sqrt(4 - 1.0 / 12);
  const Vector6 ratio = sigma(tags, picture).cwiseQuotient(sharp);
  for (int i = 0; i < 6; ++i) EXPECT_NEAR(ratio[i], std::sqrt(2), 0.03) << i;
}

TEST(DisplacementBound, OfOneStraightEdgeIsTheTextbookS) {
  // A face-on tag of stripes of 0.5 mm: its upright edges tell x. Six of them, five between stripes
  // and the black side; the other side is white in white. 3 mm are 105 px.
  SeenTag tag = chequers(0);
  for (int i = 0; i < 36; ++i) tag.white[static_cast<std::size_t>(i)] = i % 2 == 1 ? 1 : 0;
  const double spread = std::sqrt(1.5 * 1.5 + 1.0 / 12);
  const double information =
      170.0 * 170.0 * 6 * 105 / (2 * std::sqrt(std::numbers::pi) * spread * 2 * 2);
  // Turning about y moves the edges by x^2 / z, which looks like x in part: over the length of the
  // upright edges the sums of 1, x^2 and x^4 are 18, 14.25 and 21.56 mm^n, and the ends of the
  // stripes add 5.06 to the last.
  const double shared = 14.25 * 14.25 / (18 * (21.56 + 5.06));
  const double expected = 1 / std::sqrt(information * (1 - shared)) / 35e3;  // m
  EXPECT_NEAR(sigma({tag}, SeenPicture{})[0] / expected, 1, 0.02);
}

TEST(DisplacementBound, TiltedTagsTellMoreAboutDepthAndTilt) {
  const SeenPicture picture;
  const Vector6 flat = sigma({chequers(0, -2.2e-3), chequers(0, 2.2e-3)}, picture);
  const Vector6 roof = sigma({chequers(-0.785, -1.6e-3), chequers(0.785, 1.6e-3)}, picture);
  EXPECT_LT(roof[3], 0.5 * flat[3]) << "about x";
  EXPECT_LT(roof[4], 0.5 * flat[4]) << "about y";
}

/// A tag that faces -x, seen at 45 degrees in a mirror beside the lens' axis.
SeenTag in_mirror() {
  SeenTag tag = chequers(0);
  tag.white[0] = 1;  // no symmetry that would hide a picture the wrong way round
  tag.camera_T_tag.linear() << 0, 0, 1, 0, 1, 0, -1, 0, 0;
  tag.camera_T_tag.rotate(Eigen::AngleAxisd(0.2, Eigen::Vector3d(0.3, -0.5, 0.8).normalized()));
  tag.camera_T_tag.translation() = Eigen::Vector3d(6e-3, 0.4e-3, 19e-3);
  const Eigen::Vector3d normal(std::sqrt(0.5), 0, -std::sqrt(0.5));
  tag.mirror = MirrorPlane{normal, normal.dot(Eigen::Vector3d(2e-3, 0, 19e-3))};
  return tag;
}

/// What the camera takes it for: the reflected tag, printed the wrong way round.
SeenTag virtual_tag(const SeenTag& tag) {
  SeenTag out = tag;
  out.mirror.reset();
  const Eigen::Matrix3d h = tag.mirror->reflection();
  out.camera_T_tag.linear() =
      h * tag.camera_T_tag.linear() * Eigen::Vector3d(-1, 1, 1).asDiagonal();
  out.camera_T_tag.translation() = tag.mirror->behind(tag.camera_T_tag.translation());
  for (std::size_t row = 0; row < 6; ++row) {
    const auto begin = out.white.begin() + static_cast<std::ptrdiff_t>(6 * row);
    std::reverse(begin, begin + 6);
  }
  return out;
}

TEST(Mirror, ShowsAPointWhereReflectionPutsIt) {
  const MirrorPlane mirror = *in_mirror().mirror;
  const Eigen::Vector3d p(5e-3, 1e-3, 18e-3);
  const Eigen::Vector3d seen = mirror.behind(p);
  EXPECT_NEAR(mirror.normal.dot(seen) + mirror.normal.dot(p), 2 * mirror.distance, 1e-15);
  EXPECT_LT((seen - p).cross(mirror.normal).norm(), 1e-15);
  const Eigen::Vector3d step(1e-6, -2e-6, 3e-6);
  EXPECT_LT((mirror.behind(p + step) - seen - mirror.reflection() * step).norm(), 1e-15);
}

TEST(Mirror, TellsWhatTheReflectedTagTellsOfTheReflectedMotion) {
  const SeenTag tag = in_mirror();
  const Eigen::Vector3d origin(1e-3, -0.5e-3, 20e-3);
  const Matrix6 bound = displacement_bound({tag}, origin, SeenPicture{});
  const Matrix6 reflected =
      displacement_bound({virtual_tag(tag)}, tag.mirror->behind(origin), SeenPicture{});
  // In a mirror a translation t is H t, a turn r (an axial vector) is -H r.
  Matrix6 to = Matrix6::Zero();
  to.topLeftCorner<3, 3>() = tag.mirror->reflection();
  to.bottomRightCorner<3, 3>() = -tag.mirror->reflection();
  const Vector6 scale = bound.diagonal().cwiseSqrt().cwiseInverse();
  const Matrix6 difference = bound - to * reflected * to.transpose();
  EXPECT_LT((scale.asDiagonal() * difference * scale.asDiagonal()).cwiseAbs().maxCoeff(), 1e-6);
}

TEST(Mirror, SidewaysTagTellsItsOwnDepth) {
  SeenTag flat = chequers(0);
  flat.camera_T_tag.translation().x() = -2e-3;
  const SeenTag sideways = in_mirror();
  const auto depth_at = [&](const std::vector<SeenTag>& tags, const Eigen::Vector3d& point) {
    return std::sqrt(displacement_bound(tags, point, SeenPicture{})(2, 2));  // m
  };
  const double with = depth_at({flat, sideways}, sideways.camera_T_tag.translation());
  const double without = depth_at({flat, chequers(0, 3e-3)}, {0, 1.5e-3, 20e-3});
  EXPECT_LT(with, 0.3 * without);
}

TEST(Springs, SolidLengthIsThatOfTheCoils) {
  Spring spring;
  spring.coils = 20;
  EXPECT_NEAR(solid_length(spring), 14.2e-3, 1e-9);
  spring.coils = 0;
  spring.rate = 7000;
  EXPECT_NEAR(active_coils(spring), 5.44, 0.01);
  EXPECT_NEAR(solid_length(spring), 7.44 * 0.71e-3, 1e-5);
}

TEST(Modes, OfUncoupledSpringsAreTheTextbookS) {
  const Instrument i = instrument();
  const std::array<double, 6> modes = natural_frequencies(i.stiffness, i.platform);
  EXPECT_NEAR(modes[0], std::sqrt(0.03 / 2e-6) / (2 * std::numbers::pi), 0.01);
  EXPECT_NEAR(modes[1], std::sqrt(280 / 0.010) / (2 * std::numbers::pi), 0.01);
  EXPECT_NEAR(modes[2], modes[1], 1e-9);
}

TEST(Modes, FoldAtTheFrameRate) {
  EXPECT_NEAR(alias(26.6, 25), 1.6, 1e-9);
  EXPECT_NEAR(alias(12, 25), 12, 1e-9);
  EXPECT_NEAR(alias(49, 25), 1, 1e-9);
}

TEST(Reach, EndsWhereAPaperLeavesTheImage) {
  Instrument i = instrument();
  // Face-on tag in the middle: its corner is 2 mm out, 70 px; 239.5 px are there; 169.5 px are
  // 4.843 mm, which 280 N/m make of 1.356 N.
  i.tags = {chequers(0)};
  const std::array<Reach, 3> ends = reach(i, 100);
  EXPECT_NEAR(ends[1].in_view, 1.356, 0.02);
  EXPECT_NEAR(ends[0].in_view, (319.5 - 70) / 35e3 * 280, 0.03);
  // 25.4 - 14.2 mm of room under 2800 N/m.
  ASSERT_TRUE(ends[2].to_solid);
  EXPECT_NEAR(*ends[2].to_solid, 31.36, 0.01);
}

TEST(Table, StiffnessGrowsWithTheRangeAndForcesWithIt) {
  const Design table = design(instrument(), {1, 40});
  ASSERT_EQ(table.rows.size(), 3u);
  const DesignRow& one = table.rows[1];
  const DesignRow& forty = table.rows[2];
  EXPECT_NEAR(forty.lateral / one.lateral, 40, 1e-6);
  EXPECT_NEAR(forty.travel_lateral, one.travel_lateral, 1e-9);
  EXPECT_TRUE(forty.bound.isApprox(40 * one.bound, 1e-9));
  EXPECT_NEAR(forty.lowest / one.lowest, std::sqrt(40.0), 1e-9);
}

TEST(Table, DoesNotDependOnHowStiffTheGivenSpringsAre) {
  const Design soft = design(instrument(), {1, 40});
  Instrument hard = instrument();
  hard.stiffness *= 3e4;  // holds the tags in view far beyond kMaxForce
  const Design stiff = design(hard, {1, 40});
  EXPECT_GT(stiff.reach[1].in_view, 10 * kMaxForce);
  for (std::size_t i : {1U, 2U}) {
    // The search goes in steps of 1 %.
    EXPECT_NEAR(stiff.rows[i].lateral / soft.rows[i].lateral, 1, 0.011);
    EXPECT_NEAR(stiff.rows[i].travel_lateral / soft.rows[i].travel_lateral, 1, 0.011);
  }
}

TEST(Table, IsLeftOutWhereNoForceMovesTheTags) {
  Instrument rigid = instrument();
  rigid.stiffness *= 1e12;
  const Design table = design(rigid, {1, 40});
  EXPECT_EQ(table.rows.size(), 1U);
  ASSERT_FALSE(table.warnings.empty());
  EXPECT_NE(table.warnings[0].find("no table of ranges"), std::string::npos) << table.warnings[0];
}

TEST(Table, WarnsOfWhatWillNotWork) {
  const auto warned = [](const Instrument& i, const std::string& of) {
    for (const std::string& warning : design(i, {}).warnings) {
      if (warning.find(of) != std::string::npos) return true;
    }
    return false;
  };
  Instrument good = instrument();
  good.range = 0.5;
  good.frame_rate = 110;
  EXPECT_FALSE(warned(good, ""));
  Instrument far = good;
  far.range = 5;
  EXPECT_TRUE(warned(far, "leave the image"));
  Instrument shallow = good;
  for (Spring& spring : shallow.springs) spring.coils = 35.7;
  EXPECT_TRUE(warned(shallow, "bottom out"));
  Instrument impossible = good;
  for (Spring& spring : impossible.springs) spring.coils = 0;
  EXPECT_TRUE(warned(impossible, "measure the rate"));
  Instrument ringing = good;
  ringing.frame_rate = 25;
  EXPECT_TRUE(warned(ringing, "rings at 26.6 26.6 52.2 Hz"));
  Instrument blurred = good;
  blurred.picture.blur_px = 6;
  EXPECT_TRUE(warned(blurred, "run into each other"));
}

}  // namespace
}  // namespace tagwrench::study
