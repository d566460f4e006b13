#include "host/source/simulator/bench_settings.h"

#include <fmt/format.h>

#include <cmath>
#include <initializer_list>
#include <utility>

namespace tagwrench::sim {
namespace {

using Named = std::pair<const char*, double>;

std::string outside(const char* section, std::initializer_list<Named> values, double low,
                    double high) {
  for (const auto& [key, value] : values) {
    if (!(value >= low && value <= high)) {
      return fmt::format("bench.{}: {} must lie between {:g} and {:g}, is {:g}", section, key, low,
                         high, value);
    }
  }
  return {};
}

std::string problem(const char* section, const ReferenceFaults& f) {
  if (!(f.silent_from <= f.silent_to)) {
    return fmt::format("bench.{}: silent_to_s must not come before silent_from_s", section);
  }
  std::string found = outside(section, {{"clock_offset_s", f.clock_offset}}, -1e6, 1e6);
  if (found.empty()) found = outside(section, {{"clock_ppm", f.clock_ppm}}, -1e5, 1e5);
  return found;
}

std::string first_of(std::initializer_list<std::string> problems) {
  for (const std::string& text : problems) {
    if (!text.empty()) return text;
  }
  return {};
}

std::string problem(const LoadCellSettings& c) {
  const char* section = "load_cell";
  return first_of({outside(section, {{"rate_hz", c.rate}}, 1, 1000),
                   outside(section, {{"noise_mn", 1e3 * c.noise}}, 0, 1e5),
                   outside(section, {{"counts_per_newton", c.counts_per_newton}}, 1, 1e9),
                   outside(section, {{"lag_ms", 1e3 * c.lag}}, 0, 1000),
                   outside(section, {{"scale_error_percent", 100 * c.scale_error}}, 0, 30),
                   outside(section, {{"range_n", c.range}}, 1e-3, 1e6),
                   problem(section, c.faults)});
}

std::string problem(const SixAxisSettings& s) {
  const char* section = "six_axis";
  for (std::size_t i = 0; i < 6; ++i) {
    std::string found =
        first_of({outside(section, {{"counts_per_unit", s.counts_per_unit[i]}}, 1e-3, 1e9),
                  outside(section, {{"range", s.range[i]}}, 1e-6, 1e6)});
    if (!found.empty()) return found;
  }
  return first_of({outside(section, {{"rate_hz", s.rate}, {"filter_hz", s.filter_hz}}, 0.1, 1000),
                   outside(section, {{"noise_counts", s.noise_counts}}, 0, 1e5),
                   outside(section, {{"lag_ms", 1e3 * s.lag}}, 0, 1000),
                   outside(section, {{"origin_mm", 1e3 * s.origin.cwiseAbs().maxCoeff()}}, 0, 1e3),
                   outside(section, {{"place_error_mm", 1e3 * s.place_error}}, 0, 10),
                   outside(section, {{"turn_error_rad", s.turn_error}}, 0, 0.3),
                   problem(section, s.faults)});
}

}  // namespace

std::string problem(const BenchSettings& s, int tags) {
  const BenchErrors& e = s.errors;
  const BenchTimes& t = s.times;
  const BenchFaults& f = s.faults;
  if (!(s.gravity >= 0.1 && s.gravity <= 100)) {
    return fmt::format("bench.gravity must lie between 0.1 and 100, is {:g}", s.gravity);
  }
  return first_of(
      {outside("errors", {{"mass_percent", 100 * e.mass}}, 0, 30),
       outside("errors", {{"point_mm", 1e3 * e.point}, {"contact_mm", 1e3 * e.contact}}, 0, 10),
       outside("errors",
               {{"gravity_rad", e.gravity_rad},
                {"lean_rad", e.lean_rad},
                {"direction_rad", e.direction_rad},
                {"sway_rad", e.sway_rad},
                {"tremor", e.tremor}},
               0, 0.3),
       outside("errors", {{"string_mn", 1e3 * e.string}}, 0, 100),
       outside("times", {{"swing_rad", t.swing_rad}}, 0, 0.3),
       outside("times",
               {{"reaction_s", t.reaction},
                {"turn_s", t.turn},
                {"load_s", t.load},
                {"swing_decay_s", t.swing_decay}},
               0.01, 60),
       outside("times", {{"string_mm", 1e3 * t.string_length}}, 1, 1e4),
       outside("faults", {{"wrong_mass_factor", f.wrong_mass_factor}}, 0, 10),
       outside("faults",
               {{"bump_change", f.bump_change.cwiseAbs().maxCoeff()},
                {"slip_change", f.slip_change.cwiseAbs().maxCoeff()},
                {"drift_per_hour", f.drift_per_hour.cwiseAbs().maxCoeff()}},
               0, 0.5),
       outside("faults", {{"slip_tag", f.slip_tag}}, 0, tags - 1), problem(s.load_cell),
       problem(s.six_axis)});
}

}  // namespace tagwrench::sim
