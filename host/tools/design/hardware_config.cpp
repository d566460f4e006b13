#include <fmt/format.h>

#include <cmath>
#include <filesystem>
#include <initializer_list>
#include <numbers>
#include <utility>

#include "host/core/config_error.h"
#include "host/core/yaml/yaml_reader.h"
#include "host/tools/design/geometry.h"
#include "host/tracker/target.h"

namespace tagwrench {
namespace {

using hardware::CameraBoard;
using hardware::Parameters;
using hardware::TagLayout;

constexpr double kMm = 1e-3;
constexpr double kMax_mm = 1000;

/// By their keys.
using Lengths = std::initializer_list<std::pair<const char*, double&>>;

/// Zero is allowed; a part of a metre is not one of ours.
void lengths(YamlReader& node, Lengths rows, double least_mm = 0) {
  for (const auto& [key, length] : rows) length = kMm * node.within(key, least_mm, kMax_mm);
}
void present_lengths(YamlReader& node, Lengths rows) { lengths(node, rows, 0.01); }

void read_camera(YamlReader& root, CameraBoard& out) {
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
    present_lengths(root, {{"hole_mm", out.hole}});
    if (!(out.hole_spacing_x > 0 && out.hole_spacing_x + out.hole < out.width &&
          out.hole_spacing_y > 0 && out.hole_spacing_y + out.hole < out.depth))
      root.fail("hole_spacing_mm", "the holes must lie inside size_mm");
  }
  present_lengths(root, {{"plug_mm", out.plug_width}, {"lens_diameter_mm", out.lens_diameter}});
  lengths(root, {{"below_mm", out.below},
                 {"lens_height_mm", out.lens_height},
                 {"pupil_depth_mm", out.pupil_depth},
                 {"nearest_focus_mm", out.nearest_focus}});
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
}

void read_target(YamlReader& node, hardware::TargetChoice& out) {
  out.family = node.text("family");
  const auto family = family_from_name(out.family);
  if (!family)
    node.fail("family", fmt::format("there is no family '{}'; use aruco_original, grid_10x10 or "
                                    "another one that `tagwrench tags --help` names",
                                    out.family));
  out.layout = static_cast<TagLayout>(node.one_of("layout", {"roof", "slope", "mirror"}));
  const std::size_t count = out.layout == TagLayout::slope ? 1 : 2;
  out.ids.clear();
  for (const double id : node.numbers("ids", count)) {
    if (id != std::floor(id) || id < 0 || id >= id_count(*family))
      node.fail("ids", fmt::format("{} is not an id of {}; it has 0 to {}", id, out.family,
                                   id_count(*family) - 1));
    out.ids.push_back(static_cast<int>(id));
  }
  if (count == 2 && out.ids[0] == out.ids[1]) node.fail("ids", "must differ");
  present_lengths(node, {{"tag_size_mm", out.tag_size}, {"lens_distance_mm", out.lens_distance}});
  lengths(node, {{"border_mm", out.border}, {"ridge_gap_mm", out.ridge_gap}});
  out.angle = node.within("angle_deg", 0, 70) * std::numbers::pi / 180;
}

void read_springs(YamlReader& node, hardware::SpringChoice& out) {
  present_lengths(node, {{"free_length_mm", out.free_length},
                         {"outer_diameter_mm", out.outer_diameter},
                         {"wire_mm", out.wire}});
  if (2 * out.wire >= out.outer_diameter)
    node.fail("wire_mm", "leaves no hole in a spring of outer_diameter_mm; check both");
  out.axial = node.within("axial_n_per_mm", 1e-3, 1e4) / kMm;
  lengths(node, {{"socket_mm", out.socket}});
  if (2 * out.socket >= out.free_length)
    node.fail("socket_mm", "two sockets take the whole of free_length_mm; make them shallower");
  const double helix =
      hardware::lateral_ratio(out.free_length - 2 * out.socket, out.outer_diameter - out.wire);
  out.lateral = node.has("lateral_n_per_mm") ? node.within("lateral_n_per_mm", 1e-3, 1e4) / kMm
                                             : helix * out.axial;
  const std::vector<double> spacing = node.numbers("spacing_mm", 2);
  for (const double between : spacing)
    if (!(between > 0 && between <= kMax_mm))
      node.fail("spacing_mm", "the distance between spring axes must be above 0");
  out.spacing_x = kMm * spacing[0];
  out.spacing_y = kMm * spacing[1];
  out.price = node.non_negative("price_usd");
}

void read_stops(YamlReader& node, hardware::Stops& out) {
  present_lengths(node, {{"x_mm", out.x},
                         {"y_mm", out.y},
                         {"z_mm", out.z},
                         {"screw_mm", out.screw},
                         {"thread_hole_mm", out.thread_hole},
                         {"grip_mm", out.grip}});
  lengths(node, {{"gap_mm", out.gap}});
}

void read_printing(YamlReader& node, hardware::Printing& out) {
  out.nozzle = kMm * node.within("nozzle_mm", 0.1, 2);
  out.layer = kMm * node.within("layer_mm", 0.05, 1);
  lengths(node, {{"wall_mm", out.wall}, {"clearance_mm", out.clearance}});
}

void read_top(YamlReader& node, hardware::Top& out) {
  out.knob = node.one_of("shape", {"box", "knob"}) == 1;
  out.walls = node.integer("walls", 3, 4);
  if (out.knob && out.walls != 4) node.fail("walls", "a knob is closed all around; give 4");
  if (out.knob) present_lengths(node, {{"knob_mm", out.knob_diameter}});
  present_lengths(node, {{"plate_mm", out.plate},
                         {"roof_mm", out.roof},
                         {"screw_mm", out.screw},
                         {"thread_hole_mm", out.thread_hole}});
}

void read_cover(YamlReader& node, hardware::Cover& out) {
  const std::vector<double> x = node.numbers("x_mm", 2);
  if (!(x[0] < 0 && x[1] > 0 && x[0] > -kMax_mm && x[1] < kMax_mm))
    node.fail("x_mm", "give where the upper block begins and ends, below and above 0");
  out.x_from = kMm * x[0];
  out.x_to = kMm * x[1];
  present_lengths(node, {{"y_mm", out.y_half}, {"thread_hole_mm", out.thread_hole}});
  out.y_half *= 0.5;
  lengths(node, {{"ledge_mm", out.ledge}, {"wall_mm", out.wall}});
}

void read_mount(YamlReader& node, hardware::Mount& out) {
  out.puck = node.one_of("shape", {"ears", "puck"}) == 1;
  present_lengths(node, {{"thickness_mm", out.thickness}, {"width_mm", out.width}});
  lengths(node, {{"hole_mm", out.hole}});
  if (!out.puck) return;
  present_lengths(node, {{"bay_height_mm", out.bay_height}});
  out.weight = 1e-3 * node.within("weight_g", 0, 10'000);
}

void read_light(YamlReader& node, hardware::Light& out) {
  present_lengths(node, {{"seat_mm", out.width}, {"height_mm", out.height}});
  const std::vector<double> at = node.numbers("position_mm", 2);
  out.x = kMm * at[0];
  out.y = kMm * at[1];
  lengths(node, {{"diffuser_mm", out.diffuser}});
}

void read_moving(YamlReader& node, hardware::Moving& out) {
  out.mass = 1e-3 * node.within("mass_g", 0.1, 10'000);
  out.centre = kMm * Eigen::Vector3d::Map(node.numbers("centre_mm", 3).data());
  out.inertia = 1e-9 * Eigen::Vector3d::Map(node.numbers("inertia_g_mm2", 3).data());
  if (!(out.inertia.minCoeff() > 0)) node.fail("inertia_g_mm2", "must be above 0");
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
  YamlReader camera_file = YamlReader::from_file(
      (std::filesystem::path(path).parent_path() / ".." / "cameras" / (camera + ".yaml"))
          .lexically_normal()
          .string());
  read_camera(camera_file, out.camera);
  camera_file.finish();
  const auto section = [&root](const char* key, auto read, auto& into) {
    YamlReader node = root.child(key);
    read(node, into);
    node.finish();
  };
  section("target", read_target, out.target);
  section("springs", read_springs, out.springs);
  section("stops", read_stops, out.stops);
  section("print", read_printing, out.printing);
  section("top", read_top, out.top);
  section("cover", read_cover, out.cover);
  section("mount", read_mount, out.mount);
  section("light", read_light, out.light);
  section("moving", read_moving, out.moving);
  root.finish();
  return out;
}

Parameters load_buildable(const std::string& path) {
  Parameters out = load_hardware(path);
  const auto complaints = hardware::complaints(out, hardware::geometry(out));
  if (complaints.empty()) return out;
  throw ConfigError("{}: {}: {}", path, complaints.front().parameter, complaints.front().message);
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
  const Springs springs = hardware::springs(p, g);
  m.axial_stiffness = springs.axial;
  m.lateral_stiffness = springs.lateral;
  m.bending_stiffness = springs.bending;
  m.torsion_stiffness = springs.torsion;
  const Vector6 range = hardware::range(p, g);
  for (std::size_t i = 0; i < 6; ++i) {
    m.range[i] = range[i];
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
  std::erase_if(out.target.tags, [g = hardware::geometry(p)](const sim::TagPlacement& placed) {
    return std::ranges::any_of(g.tags, [&](const hardware::TagPlace& tag) {
      return tag.in_mirror && tag.id == placed.id;
    });
  });
  return out;
}

}  // namespace tagwrench
