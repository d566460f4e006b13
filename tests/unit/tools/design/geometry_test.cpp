#include "host/tools/design/geometry.h"

#include <gtest/gtest.h>

#include <Eigen/LU>

#include "tests/unit/tools/design/published.h"

namespace tagwrench::hardware {
namespace {

TEST(Geometry, PaperHasItsPublishedSizes) {
  const Parameters p = published("paper");
  const Geometry g = geometry(p);
  EXPECT_NEAR(g.top - g.bottom, 51e-3, 1e-9);
  EXPECT_NEAR(g.platform - g.pupil, 21e-3, 1e-9);
  EXPECT_NEAR(2 * (g.inner_y + p.printing.wall), 31e-3, 1e-9);
  EXPECT_NEAR(g.inner_y - p.cover.y_half, 2.5e-3, 1e-9);
  EXPECT_NEAR(g.inner_x_to - g.inner_x_from + p.printing.wall, 36e-3, 0.2e-3);
}

TEST(Geometry, StopsActAtTheirTravelAlongEachAxis) {
  const Parameters p = published("paper");
  double x = 0, y = 0, z = 0;
  for (const Vector6& d : travel_corners(p, geometry(p))) {
    if (d.tail<3>().norm() > 0) continue;
    x = std::max(x, d[0]);
    y = std::max(y, d[1]);
    z = std::max(z, d[2]);
  }
  EXPECT_DOUBLE_EQ(x, p.stops.x);
  EXPECT_DOUBLE_EQ(y, p.stops.y);
  EXPECT_DOUBLE_EQ(z, p.stops.z);
}

/// A push tilts the platform about the springs' middle; the stops, which are lower, move less than
/// the tags.
TEST(Geometry, TravelIncludesWhatAPushDoes) {
  const Parameters p = published("paper");
  const Geometry g = geometry(p);
  const Vector6 pushed = range(p, g)[1] * stiffness(p, g).inverse().col(1);
  const auto corners = travel_corners(p, g);
  EXPECT_TRUE(std::any_of(corners.begin(), corners.end(),
                          [&](const Vector6& d) { return d.isApprox(pushed, 1e-9); }));
  EXPECT_GT(pushed[1], p.stops.y);
}

/// Turned about z as far as the travel says, no corner of the cover has gone through a wall, and
/// some stop is within a tenth of acting.
TEST(Geometry, TurningEndsWhereSomethingTouches) {
  const Parameters p = published("paper");
  const Geometry g = geometry(p);
  double angle = 0;
  for (const Vector6& d : travel_corners(p, g))
    if (d.head<5>().norm() == 0) angle = std::max(angle, d[5]);
  ASSERT_GT(angle, 0);
  double most = 0;
  for (const Geometry::StopScrew& s : g.stop_screws) {
    Eigen::Vector2d tip = s.at.head<2>();
    tip[s.along] -= std::copysign(s.reach, tip[s.along]);
    const Eigen::Vector2d turned = Eigen::Rotation2Dd(angle) * tip - tip;
    const double across = s.along == 0 ? p.stops.y : p.stops.x;
    most = std::max(most, std::abs(turned[1 - s.along]) / across);
  }
  for (const double y : {-1.0, 1.0}) {
    const Eigen::Vector2d corner(p.cover.x_to, y * p.cover.y_half);
    const double moved = (Eigen::Rotation2Dd(angle) * corner - corner).y();
    EXPECT_LT(std::abs(moved), p.stops.gap + 0.4e-3);
    most = std::max(most, std::abs(moved) / p.stops.gap);
  }
  EXPECT_LE(most, 1.15);
  EXPECT_GE(most, 0.9);
}

/// How deep the stop screws are in the cover's plastic, point by point over all of each, m.
double deepest_in_plastic(const Parameters& p, const Geometry& g, const Vector6& d) {
  const Eigen::Vector3d origin(0, 0, g.platform), turn = d.tail<3>();
  Eigen::Matrix3d turned = Eigen::Matrix3d::Identity();
  if (turn.norm() > 0) turned = Eigen::AngleAxisd(turn.norm(), turn.normalized());
  double most = 0;
  for (const Geometry::StopScrew& s : g.stop_screws) {
    const Eigen::Vector3d out = std::copysign(1.0, s.at[s.along]) * Eigen::Vector3d::Unit(s.along);
    const Eigen::Vector3d across = Eigen::Vector3d::UnitZ().cross(out);
    const Eigen::Vector3d play(p.stops.x, p.stops.y, p.stops.z);
    const Eigen::Vector3d slot = Eigen::Vector3d::Constant(0.5 * p.stops.screw) + play;
    for (double along = -s.reach; along < s.head; along += 0.05e-3) {
      for (double angle = 0; angle < 2 * M_PI; angle += M_PI / 30) {
        const Eigen::Vector3d point =
            s.at + along * out +
            0.5 * p.stops.screw *
                (std::cos(angle) * across + std::sin(angle) * Eigen::Vector3d::UnitZ());
        const Eigen::Vector3d there = origin + d.head<3>() + turned * (point - origin) - s.at;
        const double under_face = -there.dot(out);
        const double beyond =
            std::max({std::abs(there.dot(across)) - slot[1 - s.along],
                      std::abs(there.z()) - slot.z(), under_face - s.reach - play[s.along]});
        most = std::max(most, std::min(under_face, beyond));
      }
    }
  }
  return most;
}

/// Leaning by 4 degrees: small angles alone would have the screws of `puck` 0.06 mm in plastic.
TEST(Geometry, NoStopScrewGoesThroughTheCoverOnItsWayToTheStop) {
  for (const char* name : {"paper", "puck", "gripper40", "single", "mirror", "endoscope"}) {
    const Parameters p = published(name);
    const Geometry g = geometry(p);
    for (const Vector6& d : travel_corners(p, g))
      EXPECT_LT(deepest_in_plastic(p, g, d), 1e-6) << name << ' ' << d.transpose();
  }
}

TEST(Geometry, APushEndsWhereSomethingTouches) {
  for (const char* name : {"paper", "puck", "gripper40", "single", "mirror", "endoscope"}) {
    const Parameters p = published(name);
    const Geometry g = geometry(p);
    const Matrix6 compliance = stiffness(p, g).inverse();
    const Vector6 most = range(p, g);
    for (int axis = 0; axis < 6; ++axis) {
      const Vector6 pushed = most[axis] * compliance.col(axis);
      EXPECT_FALSE(stopped(p, g, 0.999 * pushed) || stopped(p, g, -0.999 * pushed)) << name;
      EXPECT_TRUE(stopped(p, g, 1.001 * pushed) || stopped(p, g, -1.001 * pushed)) << name;
    }
  }
}

TEST(Geometry, StopScrewsKeepTheirGripAndAreSold) {
  for (const char* name : {"paper", "puck", "gripper40", "single", "mirror", "endoscope"}) {
    const Parameters p = published(name);
    const Geometry g = geometry(p);
    ASSERT_EQ(g.stop_screws.size(), 3U);
    for (const Geometry::StopScrew& s : g.stop_screws) {
      const double travel = s.along == 0 ? p.stops.x : p.stops.y;
      EXPECT_NEAR(s.reach - travel, p.stops.grip, 1e-12) << name;
      const double mm = 1e3 * s.length;
      EXPECT_NEAR(mm, std::round(mm), 1e-9) << name;
      EXPECT_GE(s.head - travel, p.printing.wall) << name;
    }
  }
}

/// The mirrored tag's line of sight, reflected by hand, meets the paper where it is.
TEST(Geometry, TheMirrorIsWhereItIsNeeded) {
  const Parameters p = published("mirror");
  const Geometry g = geometry(p);
  ASSERT_TRUE(g.mirror);
  const Eigen::Vector3d eye(0, 0, g.pupil);
  const Eigen::Vector3d paper =
      g.tags[1].platform_T_tag.translation() + Eigen::Vector3d(0, 0, g.platform);
  // At 45 degrees x and z change places.
  const double offset = g.mirror->centre.z() - g.mirror->centre.x();
  const Eigen::Vector3d seen(paper.z() - offset, paper.y(), paper.x() + offset);
  const Eigen::Vector3d sight = seen - eye;
  const double share = (offset - eye.z()) / (sight.z() - sight.x());
  const Eigen::Vector3d at = eye + share * sight - g.mirror->centre;
  EXPECT_LT(share, 1) << "the tag is in front of the mirror";
  EXPECT_LT(std::abs(at.x()) * std::sqrt(2.0), g.mirror->half_slope);
  EXPECT_LT(std::abs(at.y()), g.mirror->half_y);
}

TEST(Geometry, VariantsNameWhatToPrint) {
  const std::vector<std::string> box{"mounting_plate", "camera_cover", "top_plate", "light_shield"};
  EXPECT_EQ(printed_parts(published("paper")), box);
  EXPECT_EQ(printed_parts(published("puck")).back(), "puck_base");
  EXPECT_EQ(printed_parts(published("mirror")).back(), "mirror_holder");
  const Parameters p = published("paper");
  EXPECT_NE(scad_parameters(p, geometry(p), {}).find("parts = [\"mounting_plate\", "),
            std::string::npos);
}

TEST(Geometry, DrawingHasTheCellsOfItsTags) {
  const Parameters p = published("paper");
  TagPattern pattern;
  pattern.id = 7;
  pattern.cells = 3;
  pattern.white = {0, 0, 1, 0, 1, 0, 0, 0, 0};
  const std::string drawing = scad_parameters(p, geometry(p), {pattern});
  EXPECT_NE(drawing.find("\ntag_ids = [7];\n"), std::string::npos);
  EXPECT_NE(drawing.find("\ntag_bits = [[\"001\", \"010\", \"000\"]];\n"), std::string::npos);
}

TEST(Geometry, GripperBearsFortyNewtons) {
  const Parameters p = published("gripper40");
  EXPECT_GE(range(p, geometry(p)).head<3>().minCoeff(), 40);
  const Parameters puck = published("puck");
  EXPECT_NEAR(range(puck, geometry(puck)).head<3>().minCoeff(), 5, 0.5);
}

}  // namespace
}  // namespace tagwrench::hardware
