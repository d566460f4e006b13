#include "host/source/simulator/bench_config.h"

#include <utility>

#include "host/core/yaml/yaml_section.h"

namespace tagwrench {
namespace {

constexpr double kMilli = 1e-3;
constexpr double kPercent = 1e-2;
constexpr int kMaxOrders = 100'000;

void read(YamlSection& s, sim::BenchErrors& e) {
  s.number("mass_percent", e.mass, kPercent);
  s.number("point_mm", e.point, kMilli);
  s.number("contact_mm", e.contact, kMilli);
  s.number("gravity_rad", e.gravity_rad);
  s.number("lean_rad", e.lean_rad);
  s.number("string_mn", e.string, kMilli);
  s.number("direction_rad", e.direction_rad);
  s.number("sway_rad", e.sway_rad);
  s.number("tremor", e.tremor);
}

void read(YamlSection& s, sim::BenchTimes& t) {
  s.number("reaction_s", t.reaction);
  s.number("turn_s", t.turn);
  s.number("load_s", t.load);
  s.number("swing_rad", t.swing_rad);
  s.number("swing_decay_s", t.swing_decay);
  s.number("string_mm", t.string_length, kMilli);
}

void read(YamlSection& s, sim::BenchFaults& f) {
  f.wrong_mass = s.reader().integer_or("wrong_mass", 0, kMaxOrders, f.wrong_mass);
  s.number("wrong_mass_factor", f.wrong_mass_factor);
  f.bump = s.reader().integer_or("bump", 0, kMaxOrders, f.bump);
  s.numbers("bump_change", f.bump_change);
  f.slip = s.reader().integer_or("slip", 0, kMaxOrders, f.slip);
  f.slip_tag = s.reader().integer_or("slip_tag", 0, kMaxOrders, f.slip_tag);
  s.numbers("slip_change", f.slip_change);
  s.numbers("drift_per_hour", f.drift_per_hour);
}

void read(YamlSection& s, sim::ReferenceFaults& f) {
  s.number("silent_from_s", f.silent_from);
  s.number("silent_to_s", f.silent_to);
  f.wrong_sign = s.reader().boolean_or("wrong_sign", f.wrong_sign);
  s.number("clock_offset_s", f.clock_offset);
  s.number("clock_ppm", f.clock_ppm);
}

void read(YamlSection& s, sim::LoadCellSettings& c) {
  c.ideal = s.reader().boolean_or("ideal", c.ideal);
  s.number("rate_hz", c.rate);
  s.number("noise_mn", c.noise, kMilli);
  s.number("counts_per_newton", c.counts_per_newton);
  s.number("lag_ms", c.lag, kMilli);
  s.number("scale_error_percent", c.scale_error, kPercent);
  s.number("range_n", c.range);
  read(s, c.faults);
}

void read(YamlSection& s, sim::SixAxisSettings& x) {
  x.ideal = s.reader().boolean_or("ideal", x.ideal);
  s.number("rate_hz", x.rate);
  s.numbers("counts_per_unit", x.counts_per_unit);
  s.number("noise_counts", x.noise_counts);
  s.number("filter_hz", x.filter_hz);
  s.number("lag_ms", x.lag, kMilli);
  s.numbers("range", x.range);
  s.numbers("origin_mm", x.origin, kMilli);
  s.number("place_error_mm", x.place_error, kMilli);
  s.number("turn_error_rad", x.turn_error);
  read(s, x.faults);
}

}  // namespace

void read_bench(YamlReader reader, sim::BenchSettings& bench) {
  bench.perfect = reader.boolean_or("perfect", bench.perfect);
  bench.gravity = reader.number_or("gravity", bench.gravity);
  const auto section = [&reader](const char* key, auto& into) {
    if (!reader.has(key)) return;
    YamlSection child(reader.child(key));
    read(child, into);
    child.finish();
  };
  section("errors", bench.errors);
  section("times", bench.times);
  section("faults", bench.faults);
  section("load_cell", bench.load_cell);
  section("six_axis", bench.six_axis);
  reader.finish();
}

}  // namespace tagwrench
