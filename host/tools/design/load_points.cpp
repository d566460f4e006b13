#include "host/tools/design/load_points.h"

#include <algorithm>
#include <cmath>

namespace tagwrench::hardware {
namespace {

constexpr double kGravity = 9.80665;
constexpr double kOfRange = 0.9;
constexpr int kUsualWeights_g[] = {5,   10,  15,  20,  30,   50,   100, 150,
                                   200, 300, 500, 700, 1000, 1500, 2000};

}  // namespace

std::array<Eigen::Vector3d, 4> load_points(const Parameters& p, const Geometry& g) {
  const double wall = p.printing.wall;
  double right = g.inner_x_to + (p.top.walls == 4 ? wall : 0);
  double left = wall - g.inner_x_from;
  double side = g.inner_y + wall;
  double z = 0.5 * (g.plate_top + g.top) - g.platform;
  if (p.top.knob) {
    right = left = side = 0.5 * p.top.knob_diameter;
    z = 0;
  }
  return {
      Eigen::Vector3d(right + kThreadOffWall, 0, z), Eigen::Vector3d(-left - kThreadOffWall, 0, z),
      Eigen::Vector3d(0, side + kThreadOffWall, z), Eigen::Vector3d(0, -side - kThreadOffWall, z)};
}

double load_mass(const Parameters& p, const Geometry& g) {
  const Vector6 range = hardware::range(p, g);
  double most = 0;  // shares of all ranges that a newton takes together: stops add up
  for (const Eigen::Vector3d& point : load_points(p, g)) {
    for (int axis = 0; axis < 3; ++axis) {
      const Eigen::Vector3d force = Eigen::Vector3d::Unit(axis);
      Vector6 load;
      load << force, point.cross(force);
      most = std::max(most, load.cwiseAbs().cwiseQuotient(range).sum());
    }
  }
  int best = kUsualWeights_g[0];
  for (const int grams : kUsualWeights_g)
    if (1e-3 * grams * kGravity * most <= kOfRange) best = grams;
  return 1e-3 * best;
}

}  // namespace tagwrench::hardware
