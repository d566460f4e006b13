// A variant in motion: nothing collides before the stops, the stops act, and the camera sees its
// tags all the time.
#include <numbers>
#include <set>
#include <sstream>

#include "tests/hardware/variant.h"

namespace tagwrench::test {
namespace {

constexpr double kToMm = 1e3;
constexpr double kFree = 0.95, kBeyond = 1.1;  // shares of the travel
constexpr double kTurnedBeyond = 1.6;  // its ends are where a screw of any length would stop it

class VariantTravel : public Variant {
 protected:
  struct Sides {
    MeshTree fixed;
    Mesh moving;
  };
  /// With camera and screws.
  static Sides sides() {
    return {MeshTree(sensor().group(false, true)), sensor().group(true, true)};
  }

  static std::string words(const Vector6& d) {
    std::ostringstream out;
    out << (kToMm * d.head<3>()).transpose() << " mm, " << (kToMm * d.tail<3>()).transpose()
        << " mrad";
    return out.str();
  }
};

TEST_F(VariantTravel, NothingCollidesBeforeTheStops) {
  const Sides s = sides();
  for (const Vector6& corner : hardware::travel_corners(parameters(), geometry())) {
    for (const double share : {0.5, kFree}) {
      const Vector6 d = share * corner;
      const Mesh there = moved(displaced(geometry(), d), s.moving);
      const auto at = s.fixed.crossing(there);
      EXPECT_FALSE(at) << words(d) << ": at " << at->transpose();
      // Nor has one part swallowed another.
      for (const DrawnPart& part : sensor().parts) {
        const Eigen::Vector3d point = displaced(geometry(), d) * part.there.front()[0];
        EXPECT_FALSE(part.moves && s.fixed.contains(point)) << part.name;
      }
    }
  }
}

/// Two opposite corners of the travel, and turning about each axis, as OpenSCAD's `travel`: mm,
/// degrees. The rest is left to the triangles above: an intersection of such solids takes OpenSCAD
/// 2 s.
std::string corners_and_turns(const std::vector<Vector6>& travel) {
  std::set<std::string> rows;
  for (const Vector6& d : travel) {
    const bool corner = d[0] * d[1] > 0 && d[1] * d[2] > 0, turn = (d.head<3>().array() == 0).all();
    if (!corner && !turn) continue;
    std::ostringstream row;
    row << '[';
    for (int i = 0; i < 6; ++i)
      row << (i > 0 ? "," : "") << d[i] * (i < 3 ? kToMm : 180 / std::numbers::pi);
    rows.insert(row.str() + ']');
  }
  std::string out;
  for (const std::string& row : rows) out += (out.empty() ? "[" : ",") + row;
  return out + ']';
}

/// The triangles above, judged by other mathematics; of some variants only.
class VariantVolume : public VariantTravel {};

TEST_F(VariantVolume, OpenScadFindsNoneInCommon) {
  const TemporaryFolder folder;
  const std::string travel = corners_and_turns(hardware::travel_corners(parameters(), geometry()));
  const Outcome outcome = draw(Variant::folder(), TAGWRENCH_HARDWARE "/scad/sensor.scad",
                               "collision", folder / "collision.stl", {"travel=" + travel});
  // An empty drawing is reported so, and is no success.
  EXPECT_NE(outcome.err.find("Current top level object is empty."), std::string::npos)
      << outcome.err;
  EXPECT_FALSE(std::filesystem::exists(folder / "collision.stl"));
}

TEST_F(VariantTravel, TheStopsActAlongEveryAxisBothWays) {
  const Sides s = sides();
  const hardware::Stops& stops = parameters().stops;
  const Eigen::Vector3d travel(stops.x, stops.y, stops.z);
  for (int axis = 0; axis < 3; ++axis) {
    for (const double way : {-1.0, 1.0}) {
      const Vector6 d = way * kBeyond * travel[axis] * Vector6::Unit(axis);
      EXPECT_TRUE(s.fixed.crossing(moved(displaced(geometry(), d), s.moving))) << words(d);
    }
  }
  for (const Vector6& corner : hardware::travel_corners(parameters(), geometry())) {
    if (!corner.head<3>().isZero()) continue;
    EXPECT_TRUE(s.fixed.crossing(moved(displaced(geometry(), kTurnedBeyond * corner), s.moving)))
        << words(corner);
  }
}

/// Between two points, but for the last 0.3 mm, where the target itself is.
bool free_way(const MeshTree& in, const Eigen::Vector3d& from, const Eigen::Vector3d& to) {
  constexpr double kTarget_mm = 0.3;
  return !in.first_hit(from, (to - from).normalized(), (to - from).norm() - kTarget_mm);
}

TEST_F(VariantTravel, TheCameraSeesEveryTagAllTheTime) {
  const hardware::Parameters& p = parameters();
  const hardware::Geometry& g = geometry();
  const MeshTree fixed(sensor().group(false, true)), moving(sensor().group(true, true));
  const Eigen::Vector3d eye(0, 0, kToMm * g.pupil);
  const double front = kToMm * g.lens_front + 0.3;
  const double half = kToMm * (0.5 * p.target.tag_size + p.target.border);
  for (const Vector6& d : hardware::travel_corners(p, g)) {
    const Eigen::Isometry3d there = displaced(g, d);
    for (const hardware::TagPlace& tag : g.tags) {
      for (const Eigen::Vector2d& at :
           {Eigen::Vector2d(-half, -half), Eigen::Vector2d(half, -half),
            Eigen::Vector2d(half, half), Eigen::Vector2d(-half, half)}) {
        const Eigen::Vector3d corner =
            there *
            (Eigen::Vector3d(0, 0, kToMm * g.platform) + kToMm * tag.platform_T_tag.translation() +
             tag.platform_T_tag.linear() * Eigen::Vector3d(at.x(), at.y(), 0));
        Eigen::Vector3d seen = corner, turning = corner;
        if (tag.in_mirror) {
          const Eigen::Vector3d& n = g.mirror->normal;
          seen -= 2 * (n.dot(corner) - kToMm * g.mirror->distance) * n;
          const double share = (kToMm * g.mirror->distance - n.dot(eye)) / n.dot(seen - eye);
          turning = eye + share * (seen - eye);
        }
        const Eigen::Vector3d ray = seen - eye;
        EXPECT_LT(std::abs(p.camera.image.fx_px * ray.x() / ray.z()), 0.5 * p.camera.image.width_px)
            << words(d);
        EXPECT_LT(std::abs(p.camera.image.fy_px * ray.y() / ray.z()),
                  0.5 * p.camera.image.height_px)
            << words(d);
        const Eigen::Vector3d begin = eye + ray * (front - eye.z()) / ray.z();
        const auto hidden = [&](const Eigen::Vector3d& from, const Eigen::Vector3d& to) {
          return !free_way(fixed, from, to) ||
                 !free_way(moving, there.inverse() * from, there.inverse() * to);
        };
        EXPECT_FALSE(hidden(begin, turning)) << "tag " << tag.id << " at " << words(d);
        if (tag.in_mirror) {
          EXPECT_FALSE(hidden(turning + 0.3 * (corner - turning).normalized(), corner))
              << "tag " << tag.id << " behind the mirror at " << words(d);
        }
        for (const Eigen::Vector2d& axis : g.springs) {
          const Eigen::Vector3d foot(kToMm * axis.x(), kToMm * axis.y(), kToMm * g.cover_top);
          const Eigen::Vector3d head =
              there * Eigen::Vector3d(foot.x(), foot.y(), kToMm * g.plate_bottom);
          const Eigen::ParametrizedLine<double, 3> sight =
              Eigen::ParametrizedLine<double, 3>::Through(begin, turning);
          for (double u = 0; u <= 1; u += 0.02) {
            const Eigen::Vector3d coil =
                foot + u * Eigen::Vector3d(0, 0, head.z() - foot.z()) +
                u * u * (3 - 2 * u) * Eigen::Vector3d(head.x() - foot.x(), head.y() - foot.y(), 0);
            EXPECT_GT(sight.distance(coil), kToMm * 0.5 * p.springs.outer_diameter)
                << "a spring hides tag " << tag.id;
          }
        }
      }
    }
  }
}

}  // namespace
}  // namespace tagwrench::test
