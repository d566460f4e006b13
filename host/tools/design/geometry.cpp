#include "host/tools/design/geometry.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "host/core/algebra/decompositions.h"
#include "host/tracker/acquire.h"
#include "host/tracker/rotation.h"

namespace tagwrench::hardware {
namespace {

constexpr double kPoisson = 0.3;      // of steel
constexpr double kRoofEdge = 0.4e-3;  // of the roof beyond the papers
constexpr double kWindow = 1.2e-3;    // from the roof to the plate's opening
constexpr double kSkirt = 0.8e-3;     // from the shield's lower edge to the ledge, past the stop
constexpr double kBore = 0.4e-3;      // around the lens holder
constexpr double kMirrorAngle = std::numbers::pi / 4;
constexpr double kLeg = 0.5e-3;         // from the mirror to the sideways tag, past the stop
constexpr double kMirrorBack = 1.6e-3;  // of glass and holder at 45 degrees, along x
constexpr double kMirrorEdge = 0.6e-3;  // of the mirror around what is seen in it
constexpr double kBoltInset = 3.5e-3;   // of a barrel's bolts from the corners of its block
constexpr double kScrewRoom = 2.6e-3;   // from a screw of the roof to the next edge
constexpr double kMaxThread = 8e-3;     // of a bolt in the cover
constexpr double kMinThread = 4e-3;     // of a stop screw in its wall

/// Under the head, mm, as sold (ISO 4762, ISO 7045, ISO 10642).
constexpr std::array kScrewLengths_mm{4, 5, 6, 8, 10, 12, 14, 16, 20, 25, 30, 35, 40, 45, 50};

Eigen::Isometry3d turned(const Eigen::Vector3d& position, double angle,
                         const Eigen::Vector3d& axis) {
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  pose.linear() = Eigen::AngleAxisd(angle, axis).toRotationMatrix();
  pose.translation() = position;
  return pose;
}

void place_tags(const Parameters& p, Geometry& g) {
  const TargetChoice& t = p.target;
  const double half = 0.5 * t.tag_size + t.border;
  const auto x = Eigen::Vector3d::UnitX();
  switch (t.layout) {
    case TagLayout::roof:
      for (const double side : {-1.0, 1.0}) {
        g.tags.push_back(
            {.id = t.ids[side < 0 ? 0 : 1],
             .platform_T_tag = turned({0, side * (half + t.ridge_gap) * std::cos(t.angle), 0},
                                      side * t.angle, x)});
      }
      return;
    case TagLayout::slope:
      g.tags.push_back(
          {.id = t.ids[0], .platform_T_tag = turned(Eigen::Vector3d::Zero(), -t.angle, x)});
      return;
    case TagLayout::mirror: {
      // The flat tag on one side of the lens' axis, on the other the mirror, which stands still,
      // and behind it the sideways tag on a leg of the platform. The two halves keep apart by the
      // travel and the thickness of glass and holder, so that they never hide the flat tag; the
      // mirror ends below the plate.
      const double aside = half + t.ridge_gap + p.stops.x + kMirrorBack;
      const double below = 2 * (half + p.stops.z);
      g.tags.push_back({.id = t.ids[0], .platform_T_tag = turned({-aside, 0, 0}, 0, x)});
      Eigen::Isometry3d sideways = Eigen::Isometry3d::Identity();
      sideways.linear() << 0, 0, 1,  // the paper faces -x; as printed, its y is the camera's
          0, 1, 0,                   //
          -1, 0, 0;
      sideways.translation() << aside + half + p.stops.x + p.stops.z + kLeg, 0, -below;
      g.tags.push_back({.id = t.ids[1], .platform_T_tag = sideways, .in_mirror = true});
      const Eigen::Vector3d normal(std::sin(kMirrorAngle), 0, -std::cos(kMirrorAngle));
      g.mirror = Mirror{{normal, normal.dot(Eigen::Vector3d(aside, 0, g.platform - below))}};
      return;
    }
  }
}

/// Between the hood's walls and the cover.
double gap_x(const Parameters& p) { return std::max(p.stops.x, p.stops.gap); }
double gap_y(const Parameters& p) { return std::max(p.stops.y, p.stops.gap); }

/// The shortest one sold that is this long.
double sold_length(double least) {
  for (const int mm : kScrewLengths_mm)
    if (1e-3 * mm >= least - 1e-9) return 1e-3 * mm;
  return least;
}

/// As high in the cover's side as can be; under the sockets where one is above.
Geometry::StopScrew stop_screw(const Parameters& p, const Geometry& g, const Eigen::Vector2d& at,
                               int along) {
  const int across = 1 - along;
  const double travel = along == 0 ? p.stops.x : p.stops.y;
  const double half_slot = 0.5 * p.stops.screw + (along == 0 ? p.stops.y : p.stops.x);
  double top = g.cover_top - p.cover.wall;
  for (const Eigen::Vector2d& spring : g.springs) {
    const bool beside =
        std::abs(spring[across] - at[across]) > half_slot + g.socket + p.printing.nozzle;
    if (!beside) top = std::min(top, g.cover_top - p.springs.socket - 2 * p.printing.nozzle);
  }
  Geometry::StopScrew out;
  out.at << at, top - p.stops.z - 0.5 * p.stops.screw;
  out.along = along;
  out.reach = p.stops.grip + travel;
  out.length = sold_length(out.reach + (along == 0 ? gap_x(p) : gap_y(p)) +
                           std::max(kMinThread, p.printing.wall));
  out.head = out.length - out.reach;
  return out;
}

void place_screws(const Parameters& p, Geometry& g) {
  // Beside the lens, where there is room for their way in.
  const double beside = p.cover.x_to - p.cover.wall - p.stops.x - 0.5 * p.stops.screw;
  g.stop_screws = {stop_screw(p, g, {beside, p.cover.y_half}, 1),
                   stop_screw(p, g, {beside, -p.cover.y_half}, 1),
                   stop_screw(p, g, {p.cover.x_from, 0}, 0)};

  const bool board = p.camera.body == CameraBody::board;
  if (board) {
    for (const double x : {-0.5, 0.5})
      for (const double y : {-0.5, 0.5})
        g.bolts.emplace_back(x * p.camera.hole_spacing_x, y * p.camera.hole_spacing_y);
  } else {
    for (const double x : {p.cover.x_from + kBoltInset, p.cover.x_to - kBoltInset})
      for (const double y : {kBoltInset - p.cover.y_half, p.cover.y_half - kBoltInset})
        g.bolts.emplace_back(x, y);
  }
  // Up to where the ledge's slope, 45 degrees, ends above them.
  double room = std::min(g.ledge, (board ? g.board_top : p.mount.thickness) + kMaxThread);
  for (const Eigen::Vector2d& at : g.bolts) {
    const double out = std::max(
        {0.0, p.cover.x_from - at.x(), at.x() - p.cover.x_to, std::abs(at.y()) - p.cover.y_half});
    room = std::min(room, g.ledge - out);
  }
  for (const int mm : kScrewLengths_mm)
    if (1e-3 * mm <= room + 1e-9) g.bolt_length = 1e-3 * mm;

  const double aside = std::max(0.5 * p.springs.spacing_x, g.window_x + kScrewRoom);
  g.top_screws = {{-aside, 0}, {aside, 0}};
  g.plate_x = std::max(0.5 * p.springs.spacing_x + g.socket + p.cover.wall, aside + kScrewRoom);
  g.plate_y = std::max(0.5 * p.springs.spacing_y + g.socket, g.window_y) + p.cover.wall;
}

/// Where the lines of sight to the tag in it meet its plane.
void size_mirror(const Parameters& p, Geometry& g) {
  Mirror& m = *g.mirror;
  const Eigen::Vector3d slope = m.normal.cross(Eigen::Vector3d::UnitY());
  const Eigen::Vector3d origin = m.distance * m.normal;
  const Eigen::Vector3d eye(0, 0, g.pupil);
  const double half = 0.5 * p.target.tag_size + p.target.border;
  Eigen::AlignedBox2d seen;
  for (const Vector6& d : travel_corners(p, g)) {
    for (const TagPlace& tag : g.tags) {
      if (!tag.in_mirror) continue;
      for (const Eigen::Vector3d& on_tag : square_corners(half)) {
        Eigen::Vector3d corner = tag.platform_T_tag * on_tag;
        corner += d.head<3>() + d.tail<3>().cross(corner) + Eigen::Vector3d(0, 0, g.platform);
        corner = m.behind(corner);
        const double share = (m.distance - m.normal.dot(eye)) / m.normal.dot(corner - eye);
        const Eigen::Vector3d at = eye + share * (corner - eye) - origin;
        seen.extend(Eigen::Vector2d(slope.dot(at), at.y()));
      }
    }
  }
  m.centre = origin + slope * seen.center().x();
  m.half_slope = 0.5 * seen.sizes().x() + kMirrorEdge;
  m.half_y = std::max(seen.max().y(), -seen.min().y()) + kMirrorEdge;
}

// Stops: `motion` is that of all points of what moves.

constexpr int kAround = 16;                      // lines along a screw
constexpr double kReach = 0.1;                   // m, about which something turns
constexpr double kFirst = 0.1e-3, kMax = 20e-3;  // m, tried
constexpr double kGrow = 1.1;
constexpr int kHalvings = 48;

/// Slot and screw are convex: their ends say it all, the screw's tip and where it enters.
bool screw_stopped(const Parameters& p, const Geometry::StopScrew& screw,
                   const Eigen::Isometry3d& motion) {
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
  const Eigen::Vector3d out_there = motion.linear() * out;
  for (int i = 0; i < kAround; ++i) {
    const double angle = 2 * std::numbers::pi * i / kAround;
    const Eigen::Vector3d tip = screw.at - screw.reach * out +
                                radius * (std::cos(angle) * Eigen::Vector3d::Unit(across) +
                                          std::sin(angle) * Eigen::Vector3d::UnitZ());
    const Eigen::Vector3d at = motion * tip - screw.at;
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
bool hood_stopped(const Parameters& p, const Geometry& g, const Eigen::Isometry3d& motion) {
  const Eigen::Isometry3d back = motion.inverse();
  for (const double x : {p.cover.x_from, p.cover.x_to}) {
    const bool wall = x < 0 || p.top.walls == 4;
    const double wall_x = x < 0 ? g.inner_x_from : g.inner_x_to;
    const double way_x = x < 0 ? -1 : 1;
    for (const double way_y : {-1.0, 1.0}) {
      const double y = way_y * p.cover.y_half;
      for (const double z : {g.shield_bottom_y, g.cover_top})
        if (way_y * (back * Eigen::Vector3d(x, y, z)).y() > g.inner_y) return true;
      const Eigen::Vector3d edge_y =
          motion * Eigen::Vector3d(x, way_y * g.inner_y, g.shield_bottom_y);
      if (way_y * edge_y.y() < p.cover.y_half) return true;
      if (g.overhang_y > 0 && edge_y.z() < g.ledge) return true;
      if (!wall) continue;
      for (const double z : {g.shield_bottom_x, g.cover_top})
        if (way_x * ((back * Eigen::Vector3d(x, y, z)).x() - wall_x) > 0) return true;
      const Eigen::Vector3d edge_x = motion * Eigen::Vector3d(wall_x, y, g.shield_bottom_x);
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

double lateral_ratio(double length, double mean_diameter) {
  const double slenderness = length / mean_diameter;
  const double bending = slenderness * slenderness * (2 + kPoisson) / (6 * (1 + kPoisson));
  return 1 / (bending + 1 / (2 * (1 + kPoisson)));
}

Geometry geometry(const Parameters& p) {
  Geometry g;
  g.board_bottom = p.mount.thickness + p.camera.below;
  g.board_top = g.board_bottom + p.camera.thickness;
  g.lens_front = g.board_top + p.camera.lens_height;
  g.pupil = g.lens_front - p.camera.pupil_depth;
  const bool barrel = p.camera.body == CameraBody::barrel;
  g.ledge = (barrel ? p.mount.thickness : g.board_top) + p.cover.ledge;
  g.platform = g.pupil + p.target.lens_distance;
  g.plate_bottom = g.platform;
  g.plate_top = g.plate_bottom + p.top.plate;
  g.spring_attachment = p.springs.socket;
  g.spring_clear = p.springs.free_length - 2 * p.springs.socket;
  g.cover_top = g.plate_bottom - g.spring_clear;
  g.top = g.plate_top + p.top.roof;
  g.bottom = p.mount.puck ? -p.mount.bay_height : 0;
  if (!barrel) {
    const double half = 0.5 * p.camera.width;
    g.overhang_x = std::max({0.0, half + p.cover.x_from, half - p.cover.x_to});
    g.overhang_y = std::max(0.0, 0.5 * p.camera.depth - p.cover.y_half);
  }
  // Where no ledge stands in the way the walls reach down to the board.
  const double low = barrel ? g.ledge : g.board_top;
  g.shield_bottom_x = (g.overhang_x > 0 ? g.ledge : low) + p.stops.z + kSkirt;
  g.shield_bottom_y = (g.overhang_y > 0 ? g.ledge : low) + p.stops.z + kSkirt;
  if (p.top.knob)
    g.shield_bottom_x = g.shield_bottom_y = std::max(g.shield_bottom_x, g.shield_bottom_y);

  g.spring_solid = study::solid_length({.free_length = p.springs.free_length,
                                        .outer_diameter = p.springs.outer_diameter,
                                        .wire = p.springs.wire,
                                        .rate = p.springs.axial});

  place_tags(p, g);
  const double half = 0.5 * p.target.tag_size + p.target.border;
  for (const TagPlace& tag : g.tags) {
    for (const Eigen::Vector3d& on_tag : square_corners(half)) {
      const Eigen::Vector3d corner = tag.platform_T_tag * on_tag;
      g.window_x = std::max(g.window_x, std::abs(corner.x()) + kRoofEdge + kWindow);
      g.window_y = std::max(g.window_y, std::abs(corner.y()) + kRoofEdge + kWindow);
    }
  }
  g.inner_x_from = p.cover.x_from - gap_x(p);
  g.inner_x_to = p.cover.x_to + (p.top.walls == 3 ? 0 : gap_x(p));
  g.inner_y = p.cover.y_half + gap_y(p);
  g.bore = 0.5 * p.camera.lens_diameter + kBore;
  g.socket = 0.5 * p.springs.outer_diameter + p.printing.clearance;
  for (const double x : {-0.5, 0.5})
    for (const double y : {-0.5, 0.5})
      g.springs.emplace_back(x * p.springs.spacing_x, y * p.springs.spacing_y);
  place_screws(p, g);
  if (g.mirror) size_mirror(p, g);
  return g;
}

Eigen::Isometry3d platform_pose(const Geometry& g, const Vector6& displacement) {
  return moved(Eigen::Isometry3d(Eigen::Translation3d(0, 0, g.platform)), displacement);
}

std::vector<std::string> printed_parts(const Parameters& p) {
  std::vector<std::string> out{"mounting_plate", "camera_cover", "top_plate",
                               p.top.knob ? "knob" : "light_shield"};
  if (p.mount.puck) out.push_back("puck_base");
  if (p.target.layout == TagLayout::mirror) out.push_back("mirror_holder");
  return out;
}

Springs springs(const Parameters& p, const Geometry& g) {
  const double mean_diameter = p.springs.outer_diameter - p.springs.wire;
  const double turn = p.springs.axial * mean_diameter * mean_diameter * (1 + kPoisson);
  Springs out{.centres = {},
              .axial = p.springs.axial,
              .lateral = p.springs.lateral,
              .bending = turn / (2 * (2 + kPoisson)),
              .torsion = turn / 4};
  for (const Eigen::Vector2d& at : g.springs)
    out.centres.emplace_back(at.x(), at.y(), g.spring_attachment - 0.5 * p.springs.free_length);
  return out;
}

Matrix6 stiffness(const Parameters& p, const Geometry& g) {
  return tagwrench::stiffness(springs(p, g));
}

Vector6 range(const Parameters& p, const Geometry& g) {
  const Matrix6 compliance = inverse(stiffness(p, g));
  Vector6 out;
  for (int i = 0; i < 6; ++i) out[i] = 1 / share_of_travel(p, g, compliance.col(i));
  return out;
}

std::vector<Vector6> travel_corners(const Parameters& p, const Geometry& g) {
  std::vector<Vector6> out;
  for (const double x : {-p.stops.x, p.stops.x}) {
    for (const double y : {-p.stops.y, p.stops.y}) {
      for (const double z : {-p.stops.z, p.stops.z}) {
        Vector6 d = Vector6::Zero();
        d.head<3>() << x, y, z;
        out.push_back(d);
      }
    }
  }
  for (int axis = 3; axis < 6; ++axis) {
    const double angle = 1 / share_of_travel(p, g, Vector6::Unit(axis));
    for (const double way : {-angle, angle}) out.push_back(way * Vector6::Unit(axis));
  }
  // A push tilts as it shifts: the tags go further than the stops, which are lower.
  const Matrix6 compliance = inverse(stiffness(p, g));
  const Vector6 most = range(p, g);
  for (int axis = 0; axis < 6; ++axis) {
    const Vector6 pushed = most[axis] * compliance.col(axis);
    out.push_back(-pushed);
    out.push_back(pushed);
  }
  return out;
}

bool stopped(const Parameters& p, const Geometry& g, const Vector6& displacement) {
  const Eigen::Isometry3d motion =
      platform_pose(g, displacement) * Eigen::Translation3d(0, 0, -g.platform);
  for (const Geometry::StopScrew& screw : g.stop_screws)
    if (screw_stopped(p, screw, motion)) return true;
  return hood_stopped(p, g, motion);
}

double share_of_travel(const Parameters& p, const Geometry& g, const Vector6& d) {
  return 1 / std::min(times(p, g, d), times(p, g, -d));
}

}  // namespace tagwrench::hardware
