#include "host/tools/design/stops.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

namespace tagwrench::hardware {
namespace {

constexpr int kAround = 16;                      // lines along a screw
constexpr double kReach = 0.1;                   // m, about which something turns
constexpr double kFirst = 0.1e-3, kMax = 20e-3;  // m, tried
constexpr double kGrow = 1.1;
constexpr int kHalvings = 48;

/// Of the platform, about its origin.
class Motion {
 public:
  Motion(const Geometry& g, const Vector6& d) : origin_(0, 0, g.platform), shift_(d.head<3>()) {
    const double angle = d.tail<3>().norm();
    if (angle > 0) turn_ = Eigen::AngleAxisd(angle, d.tail<3>() / angle).toRotationMatrix();
  }
  Eigen::Vector3d there(const Eigen::Vector3d& point) const {
    return turned(point - origin_) + origin_ + shift_;
  }
  Eigen::Vector3d turned(const Eigen::Vector3d& way) const { return turn_ * way; }
  Eigen::Vector3d back(const Eigen::Vector3d& point) const {
    return turn_.transpose() * (point - origin_ - shift_) + origin_;
  }

 private:
  Eigen::Vector3d origin_, shift_;
  Eigen::Matrix3d turn_ = Eigen::Matrix3d::Identity();
};

/// Slot and screw are convex: their ends say it all, the screw's tip and where it enters.
bool screw_stopped(const Parameters& p, const Geometry::StopScrew& screw, const Motion& motion) {
  const int along = screw.along, across = 1 - along;
  const double along_travel = along == 0 ? p.stops.x : p.stops.y;
  const double across_travel = along == 0 ? p.stops.y : p.stops.x;
  const double radius = 0.5 * p.stops.screw;
  const double outwards = std::copysign(1.0, screw.at[along]);
  const Eigen::Vector3d out = outwards * Eigen::Vector3d::Unit(along);
  const auto beside = [&](const Eigen::Vector3d& from_middle) {
    return std::abs(from_middle[across]) > radius + across_travel ||
           std::abs(from_middle.z()) > radius + p.stops.z;
  };
  const Eigen::Vector3d out_there = motion.turned(out);
  for (int i = 0; i < kAround; ++i) {
    const double angle = 2 * std::numbers::pi * i / kAround;
    const Eigen::Vector3d tip = screw.at - screw.reach * out +
                                radius * (std::cos(angle) * Eigen::Vector3d::Unit(across) +
                                          std::sin(angle) * Eigen::Vector3d::UnitZ());
    const Eigen::Vector3d at = motion.there(tip) - screw.at;
    const double deep = -outwards * at[along];
    const bool has_left = deep < 0;
    if (has_left || deep > screw.reach + along_travel || beside(at)) return true;
    const double rise = outwards * out_there[along];
    if (beside(at + deep / rise * out_there)) return true;
  }
  return false;
}

/// The walls' inner faces and the cover's block, either's edges on the other; the walls' lower
/// edges and the ledge.
bool hood_stopped(const Parameters& p, const Geometry& g, const Motion& motion) {
  for (const double x : {p.cover.x_from, p.cover.x_to}) {
    const bool wall = x < 0 || p.top.walls == 4;
    const double wall_x = x < 0 ? g.inner_x_from : g.inner_x_to;
    const double way_x = x < 0 ? -1 : 1;
    for (const double way_y : {-1.0, 1.0}) {
      const double y = way_y * p.cover.y_half;
      for (const double z : {g.shield_bottom_y, g.cover_top})
        if (way_y * motion.back({x, y, z}).y() > g.inner_y) return true;
      const Eigen::Vector3d edge_y = motion.there({x, way_y * g.inner_y, g.shield_bottom_y});
      if (way_y * edge_y.y() < p.cover.y_half) return true;
      if (g.overhang_y > 0 && edge_y.z() < g.ledge) return true;
      if (!wall) continue;
      for (const double z : {g.shield_bottom_x, g.cover_top})
        if (way_x * (motion.back({x, y, z}).x() - wall_x) > 0) return true;
      const Eigen::Vector3d edge_x = motion.there({wall_x, y, g.shield_bottom_x});
      if (way_x * (edge_x.x() - x) < 0) return true;
      if (g.overhang_x > 0 && edge_x.z() < g.ledge) return true;
    }
  }
  return false;
}

/// How often d goes before something is met.
double times(const Parameters& p, const Geometry& g, const Vector6& d) {
  const double size = d.head<3>().norm() + kReach * d.tail<3>().norm();
  double clear = 0, met = kFirst / size;
  while (!stopped(p, g, met * d) && met * size < kMax) {
    clear = met;
    met *= kGrow;
  }
  for (int i = 0; i < kHalvings; ++i) {
    const double middle = 0.5 * (clear + met);
    (stopped(p, g, middle * d) ? met : clear) = middle;
  }
  return clear;
}

}  // namespace

bool stopped(const Parameters& p, const Geometry& g, const Vector6& displacement) {
  const Motion motion(g, displacement);
  for (const Geometry::StopScrew& screw : g.stop_screws)
    if (screw_stopped(p, screw, motion)) return true;
  return hood_stopped(p, g, motion);
}

double share_of_travel(const Parameters& p, const Geometry& g, const Vector6& d) {
  return 1 / std::min(times(p, g, d), times(p, g, -d));
}

}  // namespace tagwrench::hardware
