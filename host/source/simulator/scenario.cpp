#include "host/source/simulator/scenario.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <numbers>
#include <set>
#include <utility>

#include "host/source/simulator/prints.h"

namespace tagwrench::sim {
namespace {

constexpr double kRidgeGap = 0.15e-3;  // m, between a paper's edge and the ridge

using Named = std::pair<const char*, double>;

std::string not_positive(std::initializer_list<Named> values) {
  for (const auto& [key, value] : values) {
    if (!(value > 0) || !std::isfinite(value)) {
      return std::string(key) + " must be a positive number";
    }
  }
  return {};
}

std::string outside(std::initializer_list<Named> values, double low, double high) {
  for (const auto& [key, value] : values) {
    if (!(value >= low && value <= high)) {
      return fmt::format("{} must lie between {:g} and {:g}, is {:g}", key, low, high, value);
    }
  }
  return {};
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
    if (!ids.insert(tag.id).second) {
      return "target.tags: id " + std::to_string(tag.id) + " is there twice";
    }
    if (!tag.position.allFinite() || !tag.rotation.allFinite()) {
      return "target.tags: position and rotation must be finite numbers";
    }
  }
  if (!t.rest_position.allFinite() || t.rest_position.z() < 2 * t.tag_size) {
    return "target.rest_position: must be in front of the lens, by two tag sizes or more";
  }
  if (t.border < 0 || t.border > t.tag_size) {
    return "target.border_mm must lie between 0 and the tag size";
  }
  if (!(t.ink_spread >= 0 && t.ink_spread < 0.02 * t.tag_size)) {
    return "target.ink_spread_um must lie between 0 and 2 % of the tag size";
  }
  return {};
}

std::string delivery_problem(const Scenario& s) {
  const Delivery& d = s.delivery;
  std::string found = outside({{"delivery.latency_ms", d.latency * 1e3}}, 0, 1e4);
  if (found.empty()) found = outside({{"delivery.stale_share", d.stale_share}}, 0, 0.5);
  if (found.empty() && d.true_frame_rate != 0)
    found = outside({{"delivery.true_fps", d.true_frame_rate}}, 0.1, 2000);
  if (!found.empty()) return found;
  // Less than a tenth of the period: then stamps stay in order.
  const double most = std::min(d.latency, 0.1 * true_period(s));
  if (!(d.jitter >= 0 && d.jitter <= most)) {
    return fmt::format(
        "delivery.jitter_ms must lie between 0 and the smaller of latency_ms and a tenth of the "
        "frame period, {:g}, is {:g}",
        most * 1e3, d.jitter * 1e3);
  }
  return {};
}

std::string first_of(std::initializer_list<std::string> problems) {
  for (const std::string& text : problems) {
    if (!text.empty()) return text;
  }
  return {};
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

std::string problem(const Scenario& s) {
  const Mechanics& m = s.mechanics;
  const Trajectory& j = s.trajectory;
  if (s.camera.width_px < 64 || s.camera.width_px > 4096 || s.camera.height_px < 64 ||
      s.camera.height_px > 4096) {
    return "camera.width and height must lie between 64 and 4096";
  }
  if (j.axis < 0 || j.axis > 5) return "trajectory.axis: must be one of the six axes";
  for (const double k : s.camera.distortion) {
    if (!std::isfinite(k)) return "camera.distortion must be finite numbers";
  }
  for (std::size_t i = 0; i < 6; ++i) {
    if (!(std::abs(j.amplitude[i]) <= (i < 3 ? 1e3 : 1e2))) {
      return "trajectory.amplitude must lie within 1000 N and 100 N m";
    }
    if (!(m.range[i] > 0 && m.range[i] <= 1e6)) return "mechanics.range must be positive numbers";
  }
  if (!(m.centre_of_mass.cwiseAbs().maxCoeff() <= 1)) {
    return "mechanics.centre_of_mass_mm must lie within 1000 mm";
  }
  if (s.compression.jpeg_quality < 0 || s.compression.jpeg_quality > 100) {
    return "compression.jpeg_quality must lie between 0 and 100";
  }
  const double window = s.exposure.time + s.exposure.rolling_readout;
  std::string found = first_of(
      {outside({{"mechanics.mass_g", m.mass * 1e3}}, 0.01, 1e4),
       outside({{"mechanics.axial_n_per_mm", m.axial_stiffness * 1e-3},
                {"mechanics.lateral_n_per_mm", m.lateral_stiffness * 1e-3}},
               1e-4, 1e3),
       outside({{"mechanics.bending_nm_per_rad", m.bending_stiffness},
                {"mechanics.torsion_nm_per_rad", m.torsion_stiffness}},
               1e-6, 1e2),
       outside({{"mechanics.inertia_g_mm2", m.principal_inertia.minCoeff() * 1e9},
                {"mechanics.inertia_g_mm2", m.principal_inertia.maxCoeff() * 1e9}},
               1, 1e7),
       outside({{"mechanics.spring_length_mm", m.spring_length * 1e3},
                {"mechanics.spring_half_spacing_x_mm", m.spring_half_spacing_x * 1e3},
                {"mechanics.spring_half_spacing_y_mm", m.spring_half_spacing_y * 1e3}},
               0.1, 1e3),
       outside({{"mechanics.spring_attachment_z_mm", m.spring_attachment_z * 1e3}}, -1e3, 1e3),
       outside({{"camera.fx", s.camera.fx_px}, {"camera.fy", s.camera.fy_px}}, 1, 1e5),
       outside({{"target.tag_size_mm", s.target.tag_size * 1e3}}, 0.1, 1e3),
       not_positive({{"trajectory.bandwidth_hz", j.bandwidth},
                     {"trajectory.sweep_from_hz", j.sweep_from},
                     {"trajectory.sweep_to_hz", j.sweep_to},
                     {"trajectory.sweep_s", j.sweep_time},
                     {"trajectory.event_s", j.event_time},
                     {"optics.focus_mm", s.optics.focus_distance}}),
       outside({{"light.led_level", s.light.led_level}}, 0.001, 1),
       outside({{"light.room", s.light.room}}, 0, 100),
       outside({{"camera.fps", s.camera.frame_rate}}, 0.1, 2000),
       delivery_problem(s),
       outside({{"mechanics.damping_ratio", m.damping_ratio},
                {"mechanics.creep_share", m.creep_share},
                {"mechanics.friction", m.friction},
                {"optics.vignetting", s.optics.vignetting},
                {"light.unevenness", s.light.unevenness},
                {"light.ambient", s.light.ambient},
                {"target.paper_reflectance", s.target.paper_reflectance},
                {"target.ink_reflectance", s.target.ink_reflectance}},
               0, 1),
       outside({{"optics.psf_sigma_px", s.optics.psf_sigma_px}}, 0, 4),
       outside({{"optics.defocus_px_per_mm", s.optics.defocus_px_per_m}}, 0, 1e5),
       outside({{"exposure.time_ms", s.exposure.time},
                {"exposure.rolling_readout_ms", s.exposure.rolling_readout},
                {"trajectory.rest_s", j.rest_time},
                {"trajectory.hold_s", j.hold_time}},
               0, 1e6),
       outside({{"noise.read_counts", s.noise.read_counts},
                {"noise.shot_counts_per_count", s.noise.shot_counts_per_count},
                {"light.level_counts", s.light.level_counts},
                {"light.glare_counts", s.light.glare_counts}},
               0, 1e4),
       outside({{"target.ink_edge_roughness_um", s.target.ink_edge_roughness},
                {"target.paper_raggedness_um", s.target.paper_raggedness},
                {"target.position_error_mm", s.target.position_error}},
               0, 1e-3),
       outside({{"target.ink_grain", s.target.ink_grain},
                {"target.rotation_error_rad", s.target.rotation_error}},
               0, 0.5),
       target_problem(s.target),
       outside({{"mechanics.creep_s", m.creep_time}}, 0.1, 1e6),
       outside({{"mechanics.friction_travel", m.friction_travel}}, 1e-3, 1),
       outside({{"desk.length_s", s.desk.length}}, 1, 1e5),
       outside({{"desk.gesture_share", s.desk.gesture_share}, {"desk.wander", s.desk.wander}}, 0,
               1),
       outside({{"desk.knock_m_per_s2", s.desk.knock}}, 0, 1e3),
       problem(s.disturbances, static_cast<int>(s.target.tags.size())),
       problem(s.bench, static_cast<int>(s.target.tags.size()))});
  if (found.empty() && window > true_period(s)) {
    found = "exposure: time and readout together are longer than a frame period of camera.fps";
  }
  return found;
}

}  // namespace tagwrench::sim
