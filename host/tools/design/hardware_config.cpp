#include <fmt/format.h>

#include <cmath>
#include <filesystem>
#include <numbers>

#include "host/core/config_error.h"
#include "host/core/yaml/yaml_reader.h"
#include "host/tools/design/checks.h"
#include "host/tools/design/parameters.h"
#include "host/tracker/target.h"

namespace tagwrench {
namespace {

using hardware::CameraBoard;
using hardware::Parameters;
using hardware::TagLayout;

constexpr double kMm = 1e-3;
constexpr double kMax_mm = 1000;

/// Zero is allowed; a part of a metre is not one of ours.
double length(YamlReader& node, const char* key) { return kMm * node.within(key, 0, kMax_mm); }
double present_length(YamlReader& node, const char* key) {
  return kMm * node.within(key, 0.01, kMax_mm);
}

CameraBoard load_camera(const std::string& path) {
  YamlReader root = YamlReader::from_file(path);
  CameraBoard out;
  out.name = root.text("name");
  out.about = root.text("about");
  out.body = static_cast<hardware::CameraBody>(root.one_of("body", {"board", "barrel"}));
  const std::vector<double> size = root.numbers("size_mm", 3);
  for (const double edge : size) {
    if (!(edge > 0 && edge <= kMax_mm))
      root.fail("size_mm",
                fmt::format("{} is no edge of a camera; give width, depth, thickness", edge));
  }
  out.width = kMm * size[0];
  out.depth = kMm * size[1];
  out.thickness = kMm * size[2];
  if (out.body == hardware::CameraBody::board) {
    const std::vector<double> holes = root.numbers("hole_spacing_mm", 2);
    out.hole_spacing_x = kMm * holes[0];
    out.hole_spacing_y = kMm * holes[1];
    out.hole = present_length(root, "hole_mm");
    if (!(out.hole_spacing_x > 0 && out.hole_spacing_x + out.hole < out.width &&
          out.hole_spacing_y > 0 && out.hole_spacing_y + out.hole < out.depth))
      root.fail("hole_spacing_mm", "the holes must lie inside size_mm");
  }
  out.below = length(root, "below_mm");
  out.plug_width = present_length(root, "plug_mm");
  out.lens_diameter = present_length(root, "lens_diameter_mm");
  out.lens_height = length(root, "lens_height_mm");
  out.pupil_depth = length(root, "pupil_depth_mm");
  out.nearest_focus = length(root, "nearest_focus_mm");
  out.price = root.non_negative("price_usd");
  YamlReader image = root.child("image");
  out.image.width_px = image.integer("width", 64, 8192);
  out.image.height_px = image.integer("height", 64, 8192);
  out.image.fx_px = out.image.fy_px = image.within("focal_px", 10, 1e5);
  out.image.cx_px = 0.5 * (out.image.width_px - 1);
  out.image.cy_px = 0.5 * (out.image.height_px - 1);
  out.image.mirrored = image.boolean_or("mirrored", false);
  out.frame_rate = image.within("fps", 1, 1000);
  image.finish();
  root.finish();
  return out;
}

hardware::TargetChoice read_target(YamlReader node) {
  hardware::TargetChoice out;
  out.family = node.text("family");
  const auto family = family_from_name(out.family);
  if (!family)
    node.fail("family", fmt::format("there is no family '{}'; use aruco_original, grid_10x10 or "
                                    "another one that `tagwrench tags --help` names",
                                    out.family));
  out.layout = static_cast<TagLayout>(node.one_of("layout", {"roof", "slope", "mirror"}));
  const std::size_t count = out.layout == TagLayout::slope ? 1 : 2;
  const std::vector<double> ids = node.numbers("ids", count);
  out.ids.clear();
  for (const double id : ids) {
    if (id != std::floor(id) || id < 0 || id >= id_count(*family))
      node.fail("ids", fmt::format("{} is not an id of {}; it has 0 to {}", id, out.family,
                                   id_count(*family) - 1));
    out.ids.push_back(static_cast<int>(id));
  }
  if (count == 2 && out.ids[0] == out.ids[1]) node.fail("ids", "must differ");
  out.tag_size = present_length(node, "tag_size_mm");
  out.border = length(node, "border_mm");
  out.angle = node.within("angle_deg", 0, 70) * std::numbers::pi / 180;
  out.ridge_gap = length(node, "ridge_gap_mm");
  out.lens_distance = present_length(node, "lens_distance_mm");
  node.finish();
  return out;
}

hardware::SpringChoice read_springs(YamlReader node) {
  hardware::SpringChoice out;
  out.free_length = present_length(node, "free_length_mm");
  out.outer_diameter = present_length(node, "outer_diameter_mm");
  out.wire = present_length(node, "wire_mm");
  if (2 * out.wire >= out.outer_diameter)
    node.fail("wire_mm", "leaves no hole in a spring of outer_diameter_mm; check both");
  out.axial = node.within("axial_n_per_mm", 1e-3, 1e4) / kMm;
  out.socket = length(node, "socket_mm");
  if (2 * out.socket >= out.free_length)
    node.fail("socket_mm", "two sockets take the whole of free_length_mm; make them shallower");
  const double helix =
      hardware::lateral_ratio(out.free_length - 2 * out.socket, out.outer_diameter - out.wire);
  out.lateral = node.has("lateral_n_per_mm") ? node.within("lateral_n_per_mm", 1e-3, 1e4) / kMm
                                             : helix * out.axial;
  const std::vector<double> spacing = node.numbers("spacing_mm", 2);
  for (const double between : spacing) {
    if (!(between > 0 && between <= kMax_mm))
      node.fail("spacing_mm", "the distance between spring axes must be above 0");
  }
  out.spacing_x = kMm * spacing[0];
  out.spacing_y = kMm * spacing[1];
  out.price = node.non_negative("price_usd");
  node.finish();
  return out;
}

hardware::Stops read_stops(YamlReader node) {
  hardware::Stops out;
  out.x = present_length(node, "x_mm");
  out.y = present_length(node, "y_mm");
  out.z = present_length(node, "z_mm");
  out.gap = length(node, "gap_mm");
  out.screw = present_length(node, "screw_mm");
  out.thread_hole = present_length(node, "thread_hole_mm");
  out.grip = present_length(node, "grip_mm");
  node.finish();
  return out;
}

hardware::Printing read_printing(YamlReader node) {
  hardware::Printing out;
  out.nozzle = kMm * node.within("nozzle_mm", 0.1, 2);
  out.layer = kMm * node.within("layer_mm", 0.05, 1);
  out.wall = length(node, "wall_mm");
  out.clearance = length(node, "clearance_mm");
  node.finish();
  return out;
}

hardware::Top read_top(YamlReader node) {
  hardware::Top out;
  out.knob = node.one_of("shape", {"box", "knob"}) == 1;
  out.walls = node.integer("walls", 3, 4);
  if (out.knob && out.walls != 4) node.fail("walls", "a knob is closed all around; give 4");
  out.plate = present_length(node, "plate_mm");
  out.roof = present_length(node, "roof_mm");
  if (out.knob) out.knob_diameter = present_length(node, "knob_mm");
  out.screw = present_length(node, "screw_mm");
  out.thread_hole = present_length(node, "thread_hole_mm");
  node.finish();
  return out;
}

hardware::Cover read_cover(YamlReader node) {
  hardware::Cover out;
  const std::vector<double> x = node.numbers("x_mm", 2);
  if (!(x[0] < 0 && x[1] > 0 && x[0] > -kMax_mm && x[1] < kMax_mm))
    node.fail("x_mm", "give where the upper block begins and ends, below and above 0");
  out.x_from = kMm * x[0];
  out.x_to = kMm * x[1];
  out.y_half = 0.5 * present_length(node, "y_mm");
  out.ledge = length(node, "ledge_mm");
  out.thread_hole = present_length(node, "thread_hole_mm");
  out.wall = length(node, "wall_mm");
  node.finish();
  return out;
}

hardware::Mount read_mount(YamlReader node) {
  hardware::Mount out;
  out.puck = node.one_of("shape", {"ears", "puck"}) == 1;
  out.thickness = present_length(node, "thickness_mm");
  out.width = present_length(node, "width_mm");
  out.hole = length(node, "hole_mm");
  if (out.puck) {
    out.bay_height = present_length(node, "bay_height_mm");
    out.weight = 1e-3 * node.within("weight_g", 0, 10'000);
  }
  node.finish();
  return out;
}

hardware::Light read_light(YamlReader node) {
  hardware::Light out;
  out.width = present_length(node, "seat_mm");
  out.height = present_length(node, "height_mm");
  const std::vector<double> at = node.numbers("position_mm", 2);
  out.x = kMm * at[0];
  out.y = kMm * at[1];
  out.diffuser = length(node, "diffuser_mm");
  node.finish();
  return out;
}

hardware::Moving read_moving(YamlReader node) {
  hardware::Moving out;
  out.mass = 1e-3 * node.within("mass_g", 0.1, 10'000);
  const std::vector<double> centre = node.numbers("centre_mm", 3);
  const std::vector<double> inertia = node.numbers("inertia_g_mm2", 3);
  for (int i = 0; i < 3; ++i) {
    out.centre[i] = kMm * centre[static_cast<std::size_t>(i)];
    out.inertia[i] = 1e-9 * inertia[static_cast<std::size_t>(i)];
    if (!(out.inertia[i] > 0)) node.fail("inertia_g_mm2", "must be above 0");
  }
  node.finish();
  return out;
}

}  // namespace

Parameters load_hardware(const std::string& path) {
  YamlReader root = YamlReader::from_file(path);
  Parameters out;
  out.name = root.text("name");
  out.about = root.text("about");
  const std::string camera = root.text("camera");
  if (camera.empty() || camera.find('/') != std::string::npos)
    root.fail("camera", fmt::format("'{}' is not the name of a file in ../cameras", camera));
  out.camera = load_camera(
      (std::filesystem::path(path).parent_path() / ".." / "cameras" / (camera + ".yaml"))
          .lexically_normal()
          .string());
  out.target = read_target(root.child("target"));
  out.springs = read_springs(root.child("springs"));
  out.stops = read_stops(root.child("stops"));
  out.printing = read_printing(root.child("print"));
  out.top = read_top(root.child("top"));
  out.cover = read_cover(root.child("cover"));
  out.mount = read_mount(root.child("mount"));
  out.light = read_light(root.child("light"));
  out.moving = read_moving(root.child("moving"));
  root.finish();
  return out;
}

Parameters load_buildable(const std::string& path) {
  Parameters out = load_hardware(path);
  const auto complaints = hardware::complaints(out, hardware::geometry(out));
  if (complaints.empty()) return out;
  throw ConfigError(
      fmt::format("{}: {}: {}", path, complaints.front().parameter, complaints.front().message));
}

bool is_hardware(const std::string& path) {
  YamlReader root = YamlReader::from_file(path);
  return root.has("springs") && root.has("camera") && root.has("stops");
}

sim::Scenario scenario_of(const Parameters& p) {
  const hardware::Geometry g = hardware::geometry(p);
  sim::Scenario out;
  sim::Mechanics& m = out.mechanics;
  m.mass = p.moving.mass;
  m.centre_of_mass = p.moving.centre;
  m.principal_inertia = p.moving.inertia;
  m.spring_half_spacing_x = 0.5 * p.springs.spacing_x;
  m.spring_half_spacing_y = 0.5 * p.springs.spacing_y;
  m.spring_length = p.springs.free_length;
  m.spring_attachment_z = g.spring_attachment;
  m.axial_stiffness = p.springs.axial;
  m.lateral_stiffness = p.springs.lateral;
  // Of the helix: bending k D^2 (1+v) / (2 (2+v)), torsion k D^2 (1+v) / 4, as in Mechanics.
  constexpr double kPoisson = 0.3;
  const double diameter = p.springs.outer_diameter - p.springs.wire;
  const double turn = p.springs.axial * diameter * diameter * (1 + kPoisson);
  m.bending_stiffness = turn / (2 * (2 + kPoisson));
  m.torsion_stiffness = turn / 4;
  const Vector6 range = hardware::range(p, g);
  for (std::size_t i = 0; i < 6; ++i) {
    m.range[i] = range[static_cast<int>(i)];
    // Modest, as all six act at once.
    out.trajectory.amplitude[i] = 0.3 * m.range[i];
  }
  sim::Camera& c = out.camera;
  const CameraModel& image = p.camera.image;
  c.width_px = image.width_px;
  c.height_px = image.height_px;
  c.fx_px = image.fx_px;
  c.fy_px = image.fy_px;
  c.cx_px = image.cx_px;
  c.cy_px = image.cy_px;
  c.frame_rate = p.camera.frame_rate;
  c.mirrored = image.mirrored;
  out.optics.focus_distance = p.target.lens_distance;
  // Blur grows with the aperture's image: as the paper's camera's does, by its focal length in
  // pixels and the square of the distance.
  const double nominal = 805.0 / (21e-3 * 21e-3);
  out.optics.defocus_px_per_m *=
      image.fx_px / (p.target.lens_distance * p.target.lens_distance) / nominal;
  sim::Target& t = out.target;
  t.family = p.target.family;
  t.tag_size = p.target.tag_size;
  t.border = p.target.border;
  t.tags.clear();
  for (const hardware::TagPlace& tag : g.tags) {
    const Eigen::AngleAxisd turned(tag.platform_T_tag.linear());
    t.tags.push_back({tag.id, tag.platform_T_tag.translation(), turned.angle() * turned.axis()});
  }
  t.rest_position = {0.15e-3, -0.10e-3, p.target.lens_distance};
  return out;
}

sim::Scenario runnable_scenario_of(const Parameters& p) {
  sim::Scenario out = scenario_of(p);
  const hardware::Geometry g = hardware::geometry(p);
  std::vector<sim::TagPlacement> direct;
  for (std::size_t i = 0; i < g.tags.size(); ++i) {
    if (!g.tags[i].in_mirror) direct.push_back(out.target.tags[i]);
  }
  out.target.tags = direct;
  return out;
}

}  // namespace tagwrench
