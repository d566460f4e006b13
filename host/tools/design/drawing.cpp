#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string_view>

#include "host/tools/design/geometry.h"

namespace tagwrench::hardware {
namespace {

constexpr double kGravity = 9.80665;
constexpr double kOfRange = 0.9;
constexpr int kUsualWeights_g[] = {5,   10,  15,  20,  30,   50,   100, 150,
                                   200, 300, 500, 700, 1000, 1500, 2000};

constexpr double kToMm = 1e3;
constexpr double kToDegrees = 180 / std::numbers::pi;

/// To a nanometre: what reads as 21 in one file reads as 21 in the other.
double rounded(double value) { return std::round(1e6 * value) / 1e6 + 0.0; }

class Sheet {
 public:
  void mm(std::string_view name, double metres) { number(name, kToMm * metres); }
  void number(std::string_view name, double value) { put(name, rounded(value)); }
  void text(std::string_view name, std::string_view value) {
    put(name, fmt::format("\"{}\"", value));
  }
  /// As they stand.
  void raw(std::string_view name, const std::vector<std::string>& values) {
    put(name, fmt::format("[{}]", fmt::join(values, ", ")));
  }
  template <class Value>
  void put(std::string_view name, const Value& value) {
    text_ += fmt::format("{} = {};\n", name, value);
  }
  /// Vectors of lengths, mm.
  void list(std::string_view name, const std::vector<std::vector<double>>& rows) {
    std::vector<std::string> parts;
    for (const std::vector<double>& row : rows) {
      std::vector<double> values(row);
      for (double& v : values) v = rounded(v);
      parts.push_back(fmt::format("[{}]", fmt::join(values, ", ")));
    }
    raw(name, parts);
  }
  void comment(std::string_view words) { text_ += fmt::format("// {}\n", words); }
  std::string take() { return std::move(text_); }

 private:
  std::string text_;
};

/// OpenSCAD strings know no control characters; quotes and backslashes would end them.
std::string plain(std::string text) {
  std::replace_if(
      text.begin(), text.end(),
      [](char c) { return c == '"' || c == '\\' || static_cast<unsigned char>(c) < 0x20; }, ' ');
  return text;
}

void chosen(const Parameters& p, Sheet& s) {
  s.text("name", plain(p.name));
  s.put("camera_barrel", p.camera.body == CameraBody::barrel);
  s.mm("camera_width", p.camera.width);
  s.mm("camera_depth", p.camera.depth);
  s.mm("camera_thickness", p.camera.thickness);
  s.list("camera_holes", {{kToMm * p.camera.hole_spacing_x, kToMm * p.camera.hole_spacing_y}});
  s.mm("camera_hole", p.camera.hole);
  s.mm("camera_below", p.camera.below);
  s.mm("camera_plug", p.camera.plug_width);
  s.mm("camera_lens_diameter", p.camera.lens_diameter);
  s.mm("camera_lens_height", p.camera.lens_height);
  s.text("target_layout", p.target.layout == TagLayout::roof    ? "roof"
                          : p.target.layout == TagLayout::slope ? "slope"
                                                                : "mirror");
  s.mm("target_tag_size", p.target.tag_size);
  s.mm("target_border", p.target.border);
  s.number("target_angle", kToDegrees * p.target.angle);
  s.mm("target_ridge_gap", p.target.ridge_gap);
  s.mm("target_lens_distance", p.target.lens_distance);
  s.mm("springs_free_length", p.springs.free_length);
  s.mm("springs_outer_diameter", p.springs.outer_diameter);
  s.mm("springs_wire", p.springs.wire);
  s.mm("springs_socket", p.springs.socket);
  s.list("stops", {{kToMm * p.stops.x, kToMm * p.stops.y, kToMm * p.stops.z}});
  s.mm("stops_screw", p.stops.screw);
  s.mm("stops_thread_hole", p.stops.thread_hole);
  s.mm("stops_grip", p.stops.grip);
  s.mm("print_nozzle", p.printing.nozzle);
  s.mm("print_layer", p.printing.layer);
  s.mm("print_wall", p.printing.wall);
  s.mm("print_clearance", p.printing.clearance);
  s.put("top_knob", p.top.knob);
  s.number("top_walls", p.top.walls);
  s.mm("top_plate", p.top.plate);
  s.mm("top_roof", p.top.roof);
  s.mm("top_knob_diameter", p.top.knob_diameter);
  s.mm("top_screw", p.top.screw);
  s.mm("top_thread_hole", p.top.thread_hole);
  s.list("cover_x", {{kToMm * p.cover.x_from, kToMm * p.cover.x_to}});
  s.mm("cover_y_half", p.cover.y_half);
  s.mm("cover_wall", p.cover.wall);
  s.mm("cover_thread_hole", p.cover.thread_hole);
  s.put("mount_puck", p.mount.puck);
  s.mm("mount_thickness", p.mount.thickness);
  s.mm("mount_width", p.mount.width);
  s.mm("mount_hole", p.mount.hole);
  s.mm("mount_bay_height", p.mount.bay_height);
  s.mm("light_width", p.light.width);
  s.mm("light_height", p.light.height);
  s.list("light_position", {{kToMm * p.light.x, kToMm * p.light.y}});
  s.mm("light_diffuser", p.light.diffuser);
}

/// Rows from the top, each from the left: 1 where a cell is white.
void printed(const std::vector<TagPattern>& patterns, Sheet& s) {
  std::vector<std::string> ids, bits;
  for (const TagPattern& pattern : patterns) {
    std::vector<std::string> rows;
    for (int row = 0; row < pattern.cells; ++row) {
      std::string cells = "\"";
      for (int column = 0; column < pattern.cells; ++column)
        cells += pattern.is_white(row, column) ? '1' : '0';
      rows.push_back(cells + '"');
    }
    ids.push_back(fmt::to_string(pattern.id));
    bits.push_back(fmt::format("[{}]", fmt::join(rows, ", ")));
  }
  s.raw("tag_ids", ids);
  s.comment("rows of cells from the top, as printed; 1: white");
  s.raw("tag_bits", bits);
}

std::vector<std::vector<double>> places(const std::vector<Eigen::Vector2d>& points) {
  std::vector<std::vector<double>> out;
  for (const Eigen::Vector2d& at : points) out.push_back({kToMm * at.x(), kToMm * at.y()});
  return out;
}

void derived(const Geometry& g, Sheet& s) {
  s.mm("z_bottom", g.bottom);
  s.mm("z_board_bottom", g.board_bottom);
  s.mm("z_board_top", g.board_top);
  s.mm("z_lens_front", g.lens_front);
  s.mm("z_pupil", g.pupil);
  s.mm("z_ledge", g.ledge);
  s.mm("z_cover_top", g.cover_top);
  s.mm("z_platform", g.platform);
  s.mm("z_plate_bottom", g.plate_bottom);
  s.mm("z_plate_top", g.plate_top);
  s.mm("z_shield_bottom_x", g.shield_bottom_x);
  s.mm("z_shield_bottom_y", g.shield_bottom_y);
  s.mm("z_top", g.top);
  s.mm("bore_radius", g.bore);
  s.list("window", {{kToMm * g.window_x, kToMm * g.window_y}});
  s.list("inner_x", {{kToMm * g.inner_x_from, kToMm * g.inner_x_to}});
  s.mm("inner_y", g.inner_y);
  s.mm("socket_radius", g.socket);
  s.list("plate_half", {{kToMm * g.plate_x, kToMm * g.plate_y}});
  s.list("overhang", {{kToMm * g.overhang_x, kToMm * g.overhang_y}});
  s.mm("bolt_length", g.bolt_length);
  s.list("springs", places(g.springs));
  s.list("bolts", places(g.bolts));
  s.list("top_screws", places(g.top_screws));
  std::vector<std::vector<double>> screws, tags;
  s.comment(
      "x, y, z on the cover's face, the axis along which it points (0 x, 1 y), how far it reaches "
      "in, its length, where its head sits from the face");
  for (const Geometry::StopScrew& screw : g.stop_screws) {
    const Eigen::Vector3d at = kToMm * screw.at;
    screws.push_back({at.x(), at.y(), at.z(), double(screw.along), kToMm * screw.reach,
                      kToMm * screw.length, kToMm * screw.head});
  }
  s.list("stop_screws", screws);
  s.comment("middle in the platform's frame, then the rotation vector in degrees");
  for (const TagPlace& tag : g.tags) {
    const Eigen::AngleAxisd turn(tag.platform_T_tag.linear());
    const Eigen::Vector3d at = kToMm * tag.platform_T_tag.translation();
    const Eigen::Vector3d r = kToDegrees * turn.angle() * turn.axis();
    tags.push_back({at.x(), at.y(), at.z(), r.x(), r.y(), r.z()});
  }
  s.list("tags", tags);
  s.comment("normal, distance from the origin of the drawing; empty: no mirror");
  if (g.mirror) {
    const Eigen::Vector3d& n = g.mirror->normal;
    const Eigen::Vector3d at = kToMm * g.mirror->centre;
    s.list("mirror_plane", {{n.x(), n.y(), n.z(), kToMm * g.mirror->distance}});
    s.list("mirror_centre", {{at.x(), at.y(), at.z()}});
    s.comment("along the slope, along y");
    s.list("mirror_half", {{kToMm * g.mirror->half_slope, kToMm * g.mirror->half_y}});
  } else {
    s.list("mirror_plane", {});
  }
}

}  // namespace

std::array<Eigen::Vector3d, 4> load_points(const Parameters& p, const Geometry& g) {
  const double wall = p.printing.wall;
  double right = g.inner_x_to + (p.top.walls == 4 ? wall : 0);
  double left = wall - g.inner_x_from, side = g.inner_y + wall;
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

std::string scad_parameters(const Parameters& parameters, const Geometry& geometry,
                            const std::vector<TagPattern>& patterns) {
  Sheet sheet;
  sheet.comment("Written by `tagwrench design`; mm, degrees. As chosen:");
  chosen(parameters, sheet);
  sheet.comment("What follows; z is the height above the lower face of the mounting plate:");
  derived(geometry, sheet);
  printed(patterns, sheet);
  std::vector<std::vector<double>> loads;
  for (const Eigen::Vector3d& at : load_points(parameters, geometry))
    loads.push_back({kToMm * at.x(), kToMm * at.y(), kToMm * at.z()});
  sheet.comment("Where a weight is hung, platform's frame");
  sheet.list("load_points", loads);
  sheet.comment("Displacements at which a stop is about to be met: x y z, then turning in degrees");
  std::vector<std::vector<double>> corners;
  for (const Vector6& d : travel_corners(parameters, geometry)) {
    corners.push_back({kToMm * d[0], kToMm * d[1], kToMm * d[2], kToDegrees * d[3],
                       kToDegrees * d[4], kToDegrees * d[5]});
  }
  sheet.list("travel", corners);
  sheet.comment("To print:");
  sheet.put("parts", fmt::format("[\"{}\"]", fmt::join(printed_parts(parameters), "\", \"")));
  return sheet.take();
}

}  // namespace tagwrench::hardware
