#include "host/app/scenario_config.h"

#include <algorithm>
#include <filesystem>
#include <string_view>
#include <vector>

#include "host/core/config_error.h"
#include "host/core/yaml/yaml_section.h"
#include "host/source/simulator/bench_settings.h"
#include "host/source/simulator/disturbances.h"
#include "host/tools/design/parameters.h"

namespace tagwrench {
namespace {

constexpr double kMilli = 1e-3;
constexpr double kMicro = 1e-6;

void read_mechanics(YamlSection s, sim::Mechanics& m) {
  s.number("mass_g", m.mass, kMilli);
  s.numbers("centre_of_mass_mm", m.centre_of_mass, kMilli);
  s.numbers("inertia_g_mm2", m.principal_inertia, 1e-9);
  s.number("damping_ratio", m.damping_ratio);
  s.number("spring_half_spacing_x_mm", m.spring_half_spacing_x, kMilli);
  s.number("spring_half_spacing_y_mm", m.spring_half_spacing_y, kMilli);
  s.number("spring_length_mm", m.spring_length, kMilli);
  s.number("spring_attachment_z_mm", m.spring_attachment_z, kMilli);
  s.number("axial_n_per_mm", m.axial_stiffness, 1 / kMilli);
  s.number("lateral_n_per_mm", m.lateral_stiffness, 1 / kMilli);
  s.number("bending_nm_per_rad", m.bending_stiffness);
  s.number("torsion_nm_per_rad", m.torsion_stiffness);
  s.numbers("range", m.range);
  s.number("creep_share", m.creep_share);
  s.number("creep_s", m.creep_time);
  s.number("friction", m.friction);
  s.number("friction_travel", m.friction_travel);
  s.finish();
}

void read_camera(YamlSection s, sim::Camera& c) {
  c.width_px = s.reader().integer_or("width", 64, 4096, c.width_px);
  c.height_px = s.reader().integer_or("height", 64, 4096, c.height_px);
  s.number("fx", c.fx_px);
  s.number("fy", c.fy_px);
  s.number("cx", c.cx_px);
  s.number("cy", c.cy_px);
  s.numbers("distortion", c.distortion);
  s.number("fps", c.frame_rate);
  c.mirrored = s.reader().boolean_or("mirrored", c.mirrored);
  s.finish();
}

void read_optics(YamlSection s, sim::Optics& o) {
  s.number("psf_sigma_px", o.psf_sigma_px);
  s.number("focus_mm", o.focus_distance, kMilli);
  s.number("defocus_px_per_mm", o.defocus_px_per_m, 1 / kMilli);
  s.number("vignetting", o.vignetting);
  s.finish();
}

// Without a placement, one tag lies on a slope through the origin and two on a roof.
void read_tags(YamlReader& reader, sim::Target& t) {
  std::vector<sim::TagPlacement> tags;
  bool placed = false;
  bool all_placed = true;
  if (reader.has("tags")) {
    for (YamlReader& entry : reader.children("tags")) {
      YamlSection s(entry);
      sim::TagPlacement tag;
      tag.id = s.reader().integer("id", 0, 1'000'000);
      const bool here = s.reader().has("position_mm");
      placed = placed || here;
      all_placed = all_placed && here;
      s.numbers("position_mm", tag.position, kMilli);
      s.numbers("rotation_rad", tag.rotation);
      s.finish();
      tags.push_back(tag);
    }
  } else {
    tags = t.tags;
  }
  if (!placed && tags.size() <= 2) {
    const auto roof = sim::roof_placement(tags.front().id, tags.back().id, t.tag_size, t.border);
    t.tags = tags.size() == 2 ? roof
                              : std::vector<sim::TagPlacement>{
                                    {tags[0].id, Eigen::Vector3d::Zero(), roof[0].rotation}};
    return;
  }
  if (!all_placed)
    reader.fail("tags", "position_mm is needed for every tag, or for none of one or two");
  t.tags = tags;
}

void read_target(YamlSection s, sim::Target& t) {
  t.family = s.reader().text_or("family", t.family);
  s.number("tag_size_mm", t.tag_size, kMilli);
  s.number("border_mm", t.border, kMilli);
  read_tags(s.reader(), t);
  s.number("position_error_mm", t.position_error, kMilli);
  s.number("rotation_error_rad", t.rotation_error);
  s.numbers("rest_position_mm", t.rest_position, kMilli);
  s.number("paper_reflectance", t.paper_reflectance);
  s.number("ink_reflectance", t.ink_reflectance);
  s.number("ink_spread_um", t.ink_spread, kMicro);
  s.number("ink_edge_roughness_um", t.ink_edge_roughness, kMicro);
  s.number("ink_grain", t.ink_grain);
  s.number("paper_raggedness_um", t.paper_raggedness, kMicro);
  s.finish();
}

void read_light(YamlSection s, sim::Light& l) {
  s.number("level_counts", l.level_counts);
  s.number("unevenness", l.unevenness);
  s.number("direction_rad", l.direction);
  s.number("ambient", l.ambient);
  s.number("glare_counts", l.glare_counts);
  s.number("led_level", l.led_level);
  s.number("room", l.room);
  s.finish();
}

void read_trajectory(YamlSection s, sim::Trajectory& t) {
  s.choice("motion", t.motion,
           {"rest", "hold", "push", "steps", "sweep", "tap", "drop", "compound", "hard", "desk"});
  s.number("rest_s", t.rest_time);
  s.numbers("amplitude", t.amplitude);
  s.choice("axis", t.axis, {"fx", "fy", "fz", "mx", "my", "mz"});
  s.number("share", t.share);
  s.number("hold_s", t.hold_time);
  s.number("bandwidth_hz", t.bandwidth);
  s.number("sweep_from_hz", t.sweep_from);
  s.number("sweep_to_hz", t.sweep_to);
  s.number("sweep_s", t.sweep_time);
  s.number("event_s", t.event_time);
  s.finish();
}

void read_desk(YamlSection s, sim::DeskSettings& d) {
  s.number("length_s", d.length);
  s.number("gesture_share", d.gesture_share);
  s.number("wander", d.wander);
  s.number("knock_m_per_s2", d.knock);
  s.finish();
}

void read_exposure(YamlSection s, sim::Exposure& e) {
  s.number("time_ms", e.time, kMilli);
  s.number("rolling_readout_ms", e.rolling_readout, kMilli);
  e.even = s.reader().boolean_or("even", e.even);
  s.finish();
}

void read_delivery(YamlSection s, sim::Delivery& d) {
  s.number("latency_ms", d.latency, kMilli);
  s.number("jitter_ms", d.jitter, kMilli);
  s.number("stale_share", d.stale_share);
  s.number("true_fps", d.true_frame_rate);
  s.finish();
}

void read_noise(YamlSection s, sim::Noise& n) {
  s.number("read_counts", n.read_counts);
  s.number("shot_counts_per_count", n.shot_counts_per_count);
  s.finish();
}

void read_compression(YamlSection s, sim::Compression& c) {
  c.jpeg_quality = s.reader().integer_or("jpeg_quality", 0, 100, c.jpeg_quality);
  s.choice("file", c.file, {"png", "pgm", "jpeg"});
  s.finish();
}

/// The sensor that `hardware: FILE` names, seen from the scenario, or the published one.
sim::Scenario base_of(YamlReader& root) {
  if (!root.has("hardware")) return {};
  const auto folder = std::filesystem::path(root.file()).parent_path();
  return runnable_scenario_of(
      load_buildable((folder / root.text("hardware")).lexically_normal().string()));
}

sim::Scenario read_scenario(YamlReader root) {
  sim::Scenario scenario = base_of(root);
  scenario.seed = static_cast<std::uint64_t>(root.integer_or("seed", 0, 2'147'483'647, 1));
  const auto section = [&root](const char* key, auto read, auto& into) {
    if (root.has(key)) read(YamlSection(root.child(key)), into);
  };
  section("mechanics", read_mechanics, scenario.mechanics);
  section("camera", read_camera, scenario.camera);
  section("optics", read_optics, scenario.optics);
  section("target", read_target, scenario.target);
  section("light", read_light, scenario.light);
  section("trajectory", read_trajectory, scenario.trajectory);
  section("desk", read_desk, scenario.desk);
  section("exposure", read_exposure, scenario.exposure);
  section("delivery", read_delivery, scenario.delivery);
  section("noise", read_noise, scenario.noise);
  section("compression", read_compression, scenario.compression);
  if (root.has("disturbances")) {
    read_disturbances(root.child("disturbances"), scenario.disturbances);
  }
  if (root.has("bench")) read_bench(root.child("bench"), scenario.bench);
  root.finish();
  return scenario;
}

// "camera.fx must be ..." belongs to the line of camera.fx, or of camera where fx is not there.
[[noreturn]] void fail_at_key(YamlReader root, const std::string& problem) {
  const std::string key = problem.substr(0, problem.find_first_of(" :"));
  const std::size_t dot = key.find('.');
  const std::string section = key.substr(0, dot);
  if (dot != std::string::npos && root.has(section)) {
    YamlReader child = root.child(section);
    const std::string leaf = key.substr(dot + 1);
    if (child.has(leaf)) child.fail(leaf, problem);
  }
  root.fail(section, problem);
}

}  // namespace

sim::Scenario parse_scenario(const std::string& text, const std::string& name) {
  const YamlReader root = YamlReader::from_text(text, name);
  const sim::Scenario scenario = read_scenario(root);
  const std::string problem = sim::problem(scenario);
  if (!problem.empty()) fail_at_key(root, problem);
  return scenario;
}

sim::Scenario load_scenario(const std::string& path) {
  if (is_hardware(path)) return runnable_scenario_of(load_buildable(path));
  const YamlReader root = YamlReader::from_file(path);
  const sim::Scenario scenario = read_scenario(root);
  const std::string problem = sim::problem(scenario);
  if (!problem.empty()) fail_at_key(root, problem);
  return scenario;
}

}  // namespace tagwrench
