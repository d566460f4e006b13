#include "host/source/simulator/scenario.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <numbers>
#include <set>
#include <span>
#include <string_view>
#include <variant>

#include "host/core/yaml/yaml_reader.h"
#include "host/source/simulator/prints.h"

namespace tagwrench::sim {
namespace {

constexpr double kRidgeGap = 0.15e-3;  // m, between a paper's edge and the ridge
constexpr double kMilli = 1e-3;
constexpr double kMicro = 1e-6;
constexpr double kPercent = 1e-2;
constexpr double kLeast = std::numeric_limits<double>::min();  // above 0
constexpr double kMost = std::numeric_limits<double>::max();
constexpr int kMaxMarks = 100;
constexpr int kMaxOrders = 100'000;

/// A setting by its key in scenario.yaml: where it is kept, and the limits of a number in the unit
/// of the key.
struct Field {
  struct Choice {
    std::vector<std::string_view> names;
    std::function<void(std::size_t)> take;
  };

  Field(const char* name, double& value, double lowest, double highest, double its_unit = 1)
      : key(name), setting(std::span(&value, 1)), low(lowest), high(highest), unit(its_unit) {}
  template <typename Vector>
  requires requires(Vector& list) { list.data(); }
  Field(const char* name, Vector& list, double lowest, double highest, double its_unit = 1)
      : key(name),
        setting(std::span<double>(list.data(), static_cast<std::size_t>(list.size()))),
        low(lowest),
        high(highest),
        unit(its_unit) {}
  Field(const char* name, int& value, int lowest, int highest)
      : key(name), setting(&value), low(lowest), high(highest) {}
  Field(const char* name, bool& value) : key(name), setting(&value) {}
  template <typename Enum>
  Field(const char* name, Enum& value, std::vector<std::string_view> names)
      : key(name), setting(Choice{std::move(names), [&value](std::size_t which) {
                                    value = static_cast<Enum>(which);
                                  }}) {}

  const char* key;
  std::variant<std::span<double>, int*, bool*, Choice> setting;
  double low = -kMost, high = kMost, unit = 1;
};
using Fields = std::vector<Field>;

void read(YamlReader& reader, const Field& field) {
  if (!reader.has(field.key)) return;
  if (auto* list = std::get_if<std::span<double>>(&field.setting)) {
    const std::vector<double> numbers = list->size() == 1 ? std::vector{reader.number(field.key)}
                                                          : reader.numbers(field.key, list->size());
    std::ranges::transform(numbers, list->begin(), [&](double v) { return field.unit * v; });
  } else if (auto* whole = std::get_if<int*>(&field.setting)) {
    **whole = reader.integer(field.key, static_cast<int>(field.low), static_cast<int>(field.high));
  } else if (auto* flag = std::get_if<bool*>(&field.setting)) {
    **flag = reader.boolean(field.key);
  } else if (auto* choice = std::get_if<Field::Choice>(&field.setting)) {
    choice->take(reader.one_of(field.key, choice->names));
  }
}

/// The mapping at `key`, if it is there: its fields, and what `rest` reads beside them.
void read_section(YamlReader& reader, const char* key, const Fields& fields,
                  const std::function<void(YamlReader&)>& rest = {}) {
  if (!reader.has(key)) return;
  YamlReader section = reader.child(key);
  for (const Field& field : fields) read(section, field);
  if (rest) rest(section);
  section.finish();
}

/// The first value beyond its limits, as a message that begins with `prefix`; empty: none is.
std::string outside(const std::string& prefix, const Fields& fields) {
  for (const Field& field : fields) {
    double one = 0;
    std::span<const double> values(&one, 1);
    if (auto* whole = std::get_if<int*>(&field.setting))
      one = **whole;
    else if (auto* list = std::get_if<std::span<double>>(&field.setting))
      values = *list;
    else
      continue;
    for (const double value : values) {
      const double shown = value / field.unit;
      if (shown >= field.low && shown <= field.high) continue;
      if (field.high == kMost) {
        return fmt::format("{}{} must be a {} number", prefix, field.key,
                           field.low > 0 ? "positive" : "finite");
      }
      return fmt::format("{}{} must lie between {:g} and {:g}, is {:g}", prefix, field.key,
                         field.low, field.high, shown);
    }
  }
  return {};
}

Fields fields(Occurrence& w) {
  return {
      {"start_s", w.start, 0, 1e6}, {"length_s", w.length, 0, 1e6}, {"every_s", w.every, 0, 1e6}};
}

Fields fields(Occluder& o) {
  return {{"width_px", o.width_px, 0, 1e5},
          {"softness_px", o.softness_px, 0, 1e4},
          {"direction_rad", o.direction, -100, 100},
          {"speed_px_per_s", o.speed_px_per_s, -1e6, 1e6},
          {"aim_px", o.aim_px, -1e5, 1e5},
          {"reflectance", o.reflectance, 0, 1},
          {"texture", o.texture, 0, 1},
          {"texture_wavelength_px", o.texture_wavelength_px, 1, 1e5},
          {"shape", o.shape, std::vector<std::string_view>{"band", "disc"}}};
}

Fields fields(Glare& g) {
  return {{"peak_counts", g.peak_counts, 0, 1e4}, {"sigma_px", g.sigma_px, 0.5, 1e5},
          {"aim_px", g.aim_px, -1e5, 1e5},        {"wander_px", g.wander_px, 0, 1e5},
          {"wander_hz", g.wander_hz, 0, 1e3},     {"fade_s", g.fade, 0, 1e6}};
}

Fields fields(LightChange& l) { return {{"factor", l.factor, 0, 100}, {"fade_s", l.fade, 0, 1e6}}; }

Fields fields(Flicker& f) { return {{"depth", f.depth, 0, 1}, {"mains_hz", f.mains_hz, 0.1, 1e5}}; }

Fields fields(TurningLight& t) {
  return {{"depth", t.depth, 0, 1}, {"turn_s", t.turn, 1e-3, 1e6}, {"fade_s", t.fade, 0, 1e6}};
}

Fields fields(Dirt& d) {
  return {{"tag", d.tag, 0, kMaxMarks},
          {"specks", d.specks, 0, kMaxMarks},
          {"scratches", d.scratches, 0, kMaxMarks},
          {"size_mm", d.size, 1e-3, 100, kMilli},
          {"reflectance", d.reflectance, 0, 1}};
}

Fields fields(FocusChange& f) {
  return {{"shift_mm", f.shift, -1e3, 1e3, kMilli},
          {"fade_s", f.fade, 0, 1e6},
          {"hunt_hz", f.hunt_hz, 0, 1e3}};
}

Fields fields(LostFrames& l) {
  return {{"share", l.share, 0, 0.5}, {"most_in_a_row", l.most_in_a_row, 1, kMaxMarks}};
}

Fields fields(RandomDisturbances& r) { return {{"every_s", r.every, 0.05, 1e6}}; }

/// An instrument's own, and what all of them have.
Fields with_faults(Fields own, ReferenceFaults& f) {
  const Fields common{{"silent_from_s", f.silent_from, -kNever, kNever},
                      {"silent_to_s", f.silent_to, -kNever, kNever},
                      {"wrong_sign", f.wrong_sign},
                      {"clock_offset_s", f.clock_offset, -1e6, 1e6},
                      {"clock_ppm", f.clock_ppm, -1e5, 1e5}};
  own.insert(own.end(), common.begin(), common.end());
  return own;
}

Fields fields(BenchSettings& b) {
  return {{"perfect", b.perfect}, {"gravity", b.gravity, 0.1, 100}};
}

struct Section {
  const char* key;
  Fields fields;
};

std::vector<Section> sections(Scenario& s) {
  return {{"mechanics",
           {{"mass_g", s.mechanics.mass, 0.01, 1e4, kMilli},
            {"centre_of_mass_mm", s.mechanics.centre_of_mass, -1e3, 1e3, kMilli},
            {"inertia_g_mm2", s.mechanics.principal_inertia, 1, 1e7, 1e-9},
            {"damping_ratio", s.mechanics.damping_ratio, 0, 1},
            {"spring_half_spacing_x_mm", s.mechanics.spring_half_spacing_x, 0.1, 1e3, kMilli},
            {"spring_half_spacing_y_mm", s.mechanics.spring_half_spacing_y, 0.1, 1e3, kMilli},
            {"spring_length_mm", s.mechanics.spring_length, 0.1, 1e3, kMilli},
            {"spring_attachment_z_mm", s.mechanics.spring_attachment_z, -1e3, 1e3, kMilli},
            {"axial_n_per_mm", s.mechanics.axial_stiffness, 1e-4, 1e3, 1 / kMilli},
            {"lateral_n_per_mm", s.mechanics.lateral_stiffness, 1e-4, 1e3, 1 / kMilli},
            {"bending_nm_per_rad", s.mechanics.bending_stiffness, 1e-6, 1e2},
            {"torsion_nm_per_rad", s.mechanics.torsion_stiffness, 1e-6, 1e2},
            {"range", s.mechanics.range, kLeast, 1e6},
            {"creep_share", s.mechanics.creep_share, 0, 1},
            {"creep_s", s.mechanics.creep_time, 0.1, 1e6},
            {"friction", s.mechanics.friction, 0, 1},
            {"friction_travel", s.mechanics.friction_travel, 1e-3, 1}}},
          {"camera",
           {{"width", s.camera.width_px, 64, 4096},
            {"height", s.camera.height_px, 64, 4096},
            {"fx", s.camera.fx_px, 1, 1e5},
            {"fy", s.camera.fy_px, 1, 1e5},
            {"cx", s.camera.cx_px, -kMost, kMost},
            {"cy", s.camera.cy_px, -kMost, kMost},
            {"distortion", s.camera.distortion, -kMost, kMost},
            {"fps", s.camera.frame_rate, 0.1, 2000},
            {"mirrored", s.camera.mirrored},
            {"told_focal_factor", s.camera.told_focal_factor, 0.5, 2},
            {"told_centre_offset_px", s.camera.told_centre_offset_px, -1e3, 1e3},
            {"told_distortion", s.camera.told_distortion}}},
          {"optics",
           {{"psf_sigma_px", s.optics.psf_sigma_px, 0, 4},
            {"focus_mm", s.optics.focus_distance, kLeast, kMost, kMilli},
            {"defocus_px_per_mm", s.optics.defocus_px_per_m, 0, 100, 1 / kMilli},
            {"vignetting", s.optics.vignetting, 0, 1}}},
          {"target",
           {{"tag_size_mm", s.target.tag_size, 0.1, 1e3, kMilli},
            {"border_mm", s.target.border, -kMost, kMost, kMilli},
            {"position_error_mm", s.target.position_error, 0, 1, kMilli},
            {"rotation_error_rad", s.target.rotation_error, 0, 0.5},
            {"rest_position_mm", s.target.rest_position, -kMost, kMost, kMilli},
            {"paper_reflectance", s.target.paper_reflectance, 0, 1},
            {"ink_reflectance", s.target.ink_reflectance, 0, 1},
            {"ink_spread_um", s.target.ink_spread, -kMost, kMost, kMicro},
            {"ink_edge_roughness_um", s.target.ink_edge_roughness, 0, 1e3, kMicro},
            {"ink_grain", s.target.ink_grain, 0, 0.5},
            {"paper_raggedness_um", s.target.paper_raggedness, 0, 1e3, kMicro},
            {"print_size", s.target.print_size, -0.05, 0.05},
            {"print_aspect", s.target.print_aspect, -0.05, 0.05},
            {"print_shear", s.target.print_shear, -0.05, 0.05},
            {"ink_growth_x_um", s.target.ink_growth_x, 0, 1e3, kMicro},
            {"ink_growth_y_um", s.target.ink_growth_y, 0, 1e3, kMicro},
            {"paper_curl_um", s.target.paper_curl, -1e3, 1e3, kMicro},
            {"paper_curl_direction_rad", s.target.paper_curl_direction, -kMost, kMost},
            {"print_error", s.target.print_error, 0, 0.02}}},
          {"light",
           {{"level_counts", s.light.level_counts, 0, 1e4},
            {"unevenness", s.light.unevenness, 0, 1},
            {"direction_rad", s.light.direction, -kMost, kMost},
            {"ambient", s.light.ambient, 0, 1},
            {"glare_counts", s.light.glare_counts, 0, 1e4},
            {"led_level", s.light.led_level, 0.001, 1},
            {"room", s.light.room, 0, 100}}},
          {"trajectory",
           {{"motion",
             s.trajectory.motion,
             {"rest", "hold", "push", "steps", "sweep", "tap", "drop", "compound", "hard", "desk"}},
            {"rest_s", s.trajectory.rest_time, 0, 1e6},
            {"amplitude", s.trajectory.amplitude, -kMost, kMost},
            {"axis", s.trajectory.axis,
             std::vector<std::string_view>{"fx", "fy", "fz", "mx", "my", "mz"}},
            {"share", s.trajectory.share, -kMost, kMost},
            {"hold_s", s.trajectory.hold_time, 0, 1e6},
            {"bandwidth_hz", s.trajectory.bandwidth, kLeast, kMost},
            {"sweep_from_hz", s.trajectory.sweep_from, kLeast, kMost},
            {"sweep_to_hz", s.trajectory.sweep_to, kLeast, kMost},
            {"sweep_s", s.trajectory.sweep_time, kLeast, kMost},
            {"event_s", s.trajectory.event_time, kLeast, kMost}}},
          {"desk",
           {{"length_s", s.desk.length, 1, 1e5},
            {"gesture_share", s.desk.gesture_share, 0, 1},
            {"wander", s.desk.wander, 0, 1},
            {"knock_m_per_s2", s.desk.knock, 0, 1e3}}},
          {"exposure",
           {{"time_ms", s.exposure.time, 0, 1e9, kMilli},
            {"rolling_readout_ms", s.exposure.rolling_readout, 0, 1e9, kMilli},
            {"even", s.exposure.even}}},
          {"delivery",
           {{"latency_ms", s.delivery.latency, 0, 1e4, kMilli},
            {"jitter_ms", s.delivery.jitter, -kMost, kMost, kMilli},
            {"stale_share", s.delivery.stale_share, 0, 0.5},
            {"true_fps", s.delivery.true_frame_rate, -kMost, kMost}}},
          {"noise",
           {{"read_counts", s.noise.read_counts, 0, 1e4},
            {"shot_counts_per_count", s.noise.shot_counts_per_count, 0, 1e4}}},
          {"processing",
           {{"exposure_hunt", s.processing.exposure_hunt, 0, 0.5},
            {"exposure_hunt_hz", s.processing.exposure_hunt_hz, 0, 100},
            {"demosaicing", s.processing.demosaicing},
            {"spatial_counts", s.processing.spatial_counts, 0, 255},
            {"temporal", s.processing.temporal, 0, 0.95},
            {"temporal_counts", s.processing.temporal_counts, 0.1, 255},
            {"gamma", s.processing.gamma, 0.2, 5},
            {"contrast", s.processing.contrast, 0, 1},
            {"sharpening", s.processing.sharpening, 0, 5},
            {"sharpening_radius_px", s.processing.sharpening_radius_px, 0.3, 4}}},
          {"compression",
           {{"jpeg_quality", s.compression.jpeg_quality, 0, 100},
            {"file", s.compression.file, {"png", "pgm", "jpeg"}}}}};
}

std::vector<Section> sections(BenchSettings& b) {
  return {
      {"errors",
       {{"mass_percent", b.errors.mass, 0, 30, kPercent},
        {"point_mm", b.errors.point, 0, 10, kMilli},
        {"contact_mm", b.errors.contact, 0, 10, kMilli},
        {"gravity_rad", b.errors.gravity_rad, 0, 0.3},
        {"lean_rad", b.errors.lean_rad, 0, 0.3},
        {"direction_rad", b.errors.direction_rad, 0, 0.3},
        {"sway_rad", b.errors.sway_rad, 0, 0.3},
        {"tremor", b.errors.tremor, 0, 0.3},
        {"string_mn", b.errors.string, 0, 100, kMilli}}},
      {"times",
       {{"swing_rad", b.times.swing_rad, 0, 0.3},
        {"reaction_s", b.times.reaction, 0.01, 60},
        {"turn_s", b.times.turn, 0.01, 60},
        {"load_s", b.times.load, 0.01, 60},
        {"swing_decay_s", b.times.swing_decay, 0.01, 60},
        {"string_mm", b.times.string_length, 1, 1e4, kMilli}}},
      {"faults",
       {{"wrong_mass", b.faults.wrong_mass, 0, kMaxOrders},
        {"bump", b.faults.bump, 0, kMaxOrders},
        {"slip", b.faults.slip, 0, kMaxOrders},
        {"slip_tag", b.faults.slip_tag, 0, kMaxOrders},
        {"wrong_mass_factor", b.faults.wrong_mass_factor, 0, 10},
        {"bump_change", b.faults.bump_change, -0.5, 0.5},
        {"slip_change", b.faults.slip_change, -0.5, 0.5},
        {"drift_per_hour", b.faults.drift_per_hour, -0.5, 0.5}}},
      {"load_cell", with_faults({{"ideal", b.load_cell.ideal},
                                 {"rate_hz", b.load_cell.rate, 1, 1000},
                                 {"noise_mn", b.load_cell.noise, 0, 1e5, kMilli},
                                 {"counts_per_newton", b.load_cell.counts_per_newton, 1, 1e9},
                                 {"lag_ms", b.load_cell.lag, 0, 1000, kMilli},
                                 {"scale_error_percent", b.load_cell.scale_error, 0, 30, kPercent},
                                 {"range_n", b.load_cell.range, 1e-3, 1e6}},
                                b.load_cell.faults)},
      {"six_axis", with_faults({{"ideal", b.six_axis.ideal},
                                {"counts_per_unit", b.six_axis.counts_per_unit, 1e-3, 1e9},
                                {"range", b.six_axis.range, 1e-6, 1e6},
                                {"rate_hz", b.six_axis.rate, 0.1, 1000},
                                {"filter_hz", b.six_axis.filter_hz, 0.1, 1000},
                                {"noise_counts", b.six_axis.noise_counts, 0, 1e5},
                                {"lag_ms", b.six_axis.lag, 0, 1000, kMilli},
                                {"origin_mm", b.six_axis.origin, -1e3, 1e3, kMilli},
                                {"place_error_mm", b.six_axis.place_error, 0, 10, kMilli},
                                {"turn_error_rad", b.six_axis.turn_error, 0, 0.3}},
                               b.six_axis.faults)}};
}

/// Each list of disturbances with its key.
template <typename Visit>
void for_each_list(Disturbances& d, Visit visit) {
  visit("occluders", d.occluders);
  visit("glare", d.glare);
  visit("light", d.light);
  visit("flicker", d.flicker);
  visit("turning_light", d.turning_light);
  visit("dirt", d.dirt);
  visit("focus", d.focus);
}

// Without a placement, one tag lies on a slope through the origin and two on a roof.
void read_tags(YamlReader& reader, Target& t) {
  std::vector<TagPlacement> tags;
  bool placed = false;
  bool all_placed = true;
  if (reader.has("tags")) {
    for (YamlReader& entry : reader.children("tags")) {
      TagPlacement& tag = tags.emplace_back();
      tag.id = entry.integer("id", 0, 1'000'000);
      const bool here = entry.has("position_mm");
      placed = placed || here;
      all_placed = all_placed && here;
      read(entry, {"position_mm", tag.position, -kMost, kMost, kMilli});
      read(entry, {"rotation_rad", tag.rotation, -kMost, kMost});
      entry.finish();
    }
  } else {
    tags = t.tags;
  }
  if (!placed && tags.size() <= 2) {
    const auto roof = roof_placement(tags.front().id, tags.back().id, t.tag_size, t.border);
    t.tags =
        tags.size() == 2
            ? roof
            : std::vector<TagPlacement>{{tags[0].id, Eigen::Vector3d::Zero(), roof[0].rotation}};
    return;
  }
  if (!all_placed)
    reader.fail("tags", "position_mm is needed for every tag, or for none of one or two");
  t.tags = tags;
}

void read_disturbances(YamlReader& reader, Disturbances& d) {
  for_each_list(d, [&reader](const char* key, auto& list) {
    if (!reader.has(key)) return;
    for (YamlReader& entry : reader.children(key)) {
      auto& what = list.emplace_back();
      for (const Field& field : fields(what.when)) read(entry, field);
      for (const Field& field : fields(what)) read(entry, field);
      entry.finish();
    }
  });
  read_section(reader, "lost_frames", fields(d.lost_frames));
  read_section(reader, "random", fields(d.random),
               [&](YamlReader& section) { d.random.start = section.number("start_s"); });
}

std::string target_problem(const Target& t) {
  if (!family_exists(t.family)) return "target.family: there is no family " + t.family;
  if (t.tags.empty()) return "target.tags: at least one tag is needed";
  std::set<int> ids;
  for (const TagPlacement& tag : t.tags) {
    if (tag.id < 0 || tag.id >= family_size(t.family)) {
      return "target.tags: id " + std::to_string(tag.id) + " does not exist in " + t.family +
             ", which has ids 0 to " + std::to_string(family_size(t.family) - 1);
    }
    if (!ids.insert(tag.id).second)
      return "target.tags: id " + std::to_string(tag.id) + " is there twice";
    if (!tag.position.allFinite() || !tag.rotation.allFinite())
      return "target.tags: position and rotation must be finite numbers";
  }
  if (!t.rest_position.allFinite() || t.rest_position.z() < 2 * t.tag_size)
    return "target.rest_position: must be in front of the lens, by two tag sizes or more";
  if (t.border < 0 || t.border > t.tag_size)
    return "target.border_mm must lie between 0 and the tag size";
  if (!(t.ink_spread >= 0 && t.ink_spread < 0.02 * t.tag_size))
    return "target.ink_spread_um must lie between 0 and 2 % of the tag size";
  if (std::max(t.ink_growth_x, t.ink_growth_y) > 0.02 * t.tag_size)
    return "target.ink_growth_x_um and ink_growth_y_um must lie between 0 and 2 % of the tag size";
  return {};
}

std::string delivery_problem(Scenario& s) {
  Delivery& d = s.delivery;
  if (d.true_frame_rate != 0) {
    std::string found = outside("delivery.", {{"true_fps", d.true_frame_rate, 0.1, 2000}});
    if (!found.empty()) return found;
  }
  // Less than a tenth of the period: then stamps stay in order.
  const double most = std::min(d.latency, 0.1 * true_period(s));
  if (d.jitter >= 0 && d.jitter <= most) return {};
  return fmt::format(
      "delivery.jitter_ms must lie between 0 and the smaller of latency_ms and a tenth of the "
      "frame period, {:g}, is {:g}",
      most * 1e3, d.jitter * 1e3);
}

std::string disturbance_problem(Disturbances& d, int tags) {
  std::string found;
  for_each_list(d, [&](const char* key, auto& list) {
    const std::string section = fmt::format("disturbances.{}: ", key);
    for (auto& what : list) {
      if (found.empty()) found = outside(section, fields(what.when));
      if (found.empty() && what.when.every > 0 && what.when.every < what.when.length)
        found = section + "every_s must be 0 or at least length_s";
      if constexpr (requires { what.specks; }) {
        if (found.empty() && (what.tag < 0 || what.tag >= tags))
          found = fmt::format("{}tag counts target.tags from 0, so 0 to {}, not {}", section,
                              tags - 1, what.tag);
      }
      if (found.empty()) found = outside(section, fields(what));
    }
  });
  if (found.empty()) found = outside("disturbances.lost_frames: ", fields(d.lost_frames));
  if (found.empty()) found = outside("disturbances.random: ", fields(d.random));
  if (found.empty() && !(d.random.start >= 0))  // infinity is never
    found = "disturbances.random: start_s must not be negative";
  return found;
}

std::string bench_problem(BenchSettings& b, int tags) {
  std::string found = outside("bench.", fields(b));
  for (const auto& [key, fields] : sections(b))
    if (found.empty()) found = outside(fmt::format("bench.{}: ", key), fields);
  if (found.empty())
    found = outside("bench.faults: ", {{"slip_tag", b.faults.slip_tag, 0, tags - 1}});
  for (const auto& [key, faults] :
       {std::pair{"load_cell", &b.load_cell.faults}, std::pair{"six_axis", &b.six_axis.faults}})
    if (found.empty() && !(faults->silent_from <= faults->silent_to))
      found = fmt::format("bench.{}: silent_to_s must not come before silent_from_s", key);
  return found;
}

}  // namespace

std::vector<TagPlacement> roof_placement(int upper_id, int lower_id, double tag_size,
                                         double border) {
  const double slope = std::numbers::pi / 4;
  const double to_ridge = (0.5 * tag_size + border + kRidgeGap) * std::cos(slope);
  return {{upper_id, {0, -to_ridge, 0}, {-slope, 0, 0}},
          {lower_id, {0, to_ridge, 0}, {slope, 0, 0}}};
}

double true_period(const Scenario& s) {
  const double rate = s.delivery.true_frame_rate;
  return 1 / (rate > 0 ? rate : s.camera.frame_rate);
}

void read_scenario(YamlReader& root, Scenario& scenario) {
  scenario.seed = static_cast<std::uint64_t>(root.integer_or("seed", 0, 2'147'483'647, 1));
  for (const auto& [key, fields] : sections(scenario)) {
    read_section(root, key, fields, [&, key = std::string_view(key)](YamlReader& section) {
      if (key != "target") return;
      scenario.target.family = section.text_or("family", scenario.target.family);
      read_tags(section, scenario.target);
    });
  }
  read_section(root, "disturbances", {},
               [&](YamlReader& section) { read_disturbances(section, scenario.disturbances); });
  read_section(root, "bench", fields(scenario.bench), [&](YamlReader& bench) {
    for (const auto& [key, fields] : sections(scenario.bench)) read_section(bench, key, fields);
  });
}

std::string problem(const Scenario& scenario) {
  Scenario s = scenario;
  const int tags = static_cast<int>(s.target.tags.size());
  if (s.trajectory.axis < 0 || s.trajectory.axis > 5)
    return "trajectory.axis: must be one of the six axes";
  for (std::size_t i = 0; i < 6; ++i)
    if (!(std::abs(s.trajectory.amplitude[i]) <= (i < 3 ? 1e3 : 1e2)))
      return "trajectory.amplitude must lie within 1000 N and 100 N m";
  std::string found;
  for (const auto& [key, fields] : sections(s))
    if (found.empty()) found = outside(fmt::format("{}.", key), fields);
  if (found.empty()) found = delivery_problem(s);
  if (found.empty()) found = target_problem(s.target);
  if (found.empty()) found = disturbance_problem(s.disturbances, tags);
  if (found.empty()) found = bench_problem(s.bench, tags);
  if (found.empty() && s.exposure.time + s.exposure.rolling_readout > true_period(s))
    found = "exposure: time and readout together are longer than a frame period of camera.fps";
  return found;
}

}  // namespace tagwrench::sim
