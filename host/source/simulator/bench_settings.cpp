#include "host/source/simulator/bench_settings.h"

#include <fmt/format.h>

#include "host/source/simulator/fields.h"

namespace tagwrench::sim {
namespace {

constexpr int kMaxOrders = 100'000;

Fields fields(BenchErrors& e) {
  return {{"mass_percent", e.mass, 0, 30, kPercent}, {"point_mm", e.point, 0, 10, kMilli},
          {"contact_mm", e.contact, 0, 10, kMilli},  {"gravity_rad", e.gravity_rad, 0, 0.3},
          {"lean_rad", e.lean_rad, 0, 0.3},          {"direction_rad", e.direction_rad, 0, 0.3},
          {"sway_rad", e.sway_rad, 0, 0.3},          {"tremor", e.tremor, 0, 0.3},
          {"string_mn", e.string, 0, 100, kMilli}};
}

Fields fields(BenchTimes& t) {
  return {{"swing_rad", t.swing_rad, 0, 0.3},
          {"reaction_s", t.reaction, 0.01, 60},
          {"turn_s", t.turn, 0.01, 60},
          {"load_s", t.load, 0.01, 60},
          {"swing_decay_s", t.swing_decay, 0.01, 60},
          {"string_mm", t.string_length, 1, 1e4, kMilli}};
}

Fields fields(BenchFaults& f) {
  return {{"wrong_mass_factor", f.wrong_mass_factor, 0, 10},
          {"bump_change", f.bump_change, -0.5, 0.5},
          {"slip_change", f.slip_change, -0.5, 0.5},
          {"drift_per_hour", f.drift_per_hour, -0.5, 0.5}};
}

Fields fields(ReferenceFaults& f) {
  return {{"silent_from_s", f.silent_from, -kNoLimit, kNoLimit},
          {"silent_to_s", f.silent_to, -kNoLimit, kNoLimit},
          {"clock_offset_s", f.clock_offset, -1e6, 1e6},
          {"clock_ppm", f.clock_ppm, -1e5, 1e5}};
}

Fields fields(LoadCellSettings& c) {
  return {{"rate_hz", c.rate, 1, 1000},
          {"noise_mn", c.noise, 0, 1e5, kMilli},
          {"counts_per_newton", c.counts_per_newton, 1, 1e9},
          {"lag_ms", c.lag, 0, 1000, kMilli},
          {"scale_error_percent", c.scale_error, 0, 30, kPercent},
          {"range_n", c.range, 1e-3, 1e6}};
}

Fields fields(SixAxisSettings& x) {
  return {{"counts_per_unit", x.counts_per_unit, 1e-3, 1e9},
          {"range", x.range, 1e-6, 1e6},
          {"rate_hz", x.rate, 0.1, 1000},
          {"filter_hz", x.filter_hz, 0.1, 1000},
          {"noise_counts", x.noise_counts, 0, 1e5},
          {"lag_ms", x.lag, 0, 1000, kMilli},
          {"origin_mm", x.origin, -1e3, 1e3, kMilli},
          {"place_error_mm", x.place_error, 0, 10, kMilli},
          {"turn_error_rad", x.turn_error, 0, 0.3}};
}

// What of a section is no plain number.
template <typename T>
void read_rest(YamlSection&, T&) {}
void read_rest(YamlSection& s, BenchFaults& f) {
  f.wrong_mass = s.reader().integer_or("wrong_mass", 0, kMaxOrders, f.wrong_mass);
  f.bump = s.reader().integer_or("bump", 0, kMaxOrders, f.bump);
  f.slip = s.reader().integer_or("slip", 0, kMaxOrders, f.slip);
  f.slip_tag = s.reader().integer_or("slip_tag", 0, kMaxOrders, f.slip_tag);
}
template <typename Instrument>
void read_instrument(YamlSection& s, Instrument& i) {
  i.ideal = s.reader().boolean_or("ideal", i.ideal);
  i.faults.wrong_sign = s.reader().boolean_or("wrong_sign", i.faults.wrong_sign);
  read_fields(s, fields(i.faults));
}
void read_rest(YamlSection& s, LoadCellSettings& c) { read_instrument(s, c); }
void read_rest(YamlSection& s, SixAxisSettings& x) { read_instrument(s, x); }

std::string fault_problem(const char* section, ReferenceFaults& f) {
  if (!(f.silent_from <= f.silent_to))
    return fmt::format("{}: silent_to_s must not come before silent_from_s", section);
  return outside(section, fields(f));
}

}  // namespace

std::string problem(const BenchSettings& settings, int tags) {
  BenchSettings s = settings;
  if (!(s.gravity >= 0.1 && s.gravity <= 100)) {
    return fmt::format("bench.gravity must lie between 0.1 and 100, is {:g}", s.gravity);
  }
  double slip_tag = s.faults.slip_tag;
  for (const std::string& text :
       {outside("bench.errors", fields(s.errors)), outside("bench.times", fields(s.times)),
        outside("bench.faults", fields(s.faults)),
        outside("bench.faults", {{"slip_tag", slip_tag, 0, tags - 1.0}}),
        outside("bench.load_cell", fields(s.load_cell)),
        fault_problem("bench.load_cell", s.load_cell.faults),
        outside("bench.six_axis", fields(s.six_axis)),
        fault_problem("bench.six_axis", s.six_axis.faults)}) {
    if (!text.empty()) return text;
  }
  return {};
}

void read_bench(YamlReader reader, BenchSettings& bench) {
  bench.perfect = reader.boolean_or("perfect", bench.perfect);
  bench.gravity = reader.number_or("gravity", bench.gravity);
  const auto section = [&reader](const char* key, auto& into) {
    if (!reader.has(key)) return;
    YamlSection child(reader.child(key));
    read_fields(child, fields(into));
    read_rest(child, into);
    child.finish();
  };
  section("errors", bench.errors);
  section("times", bench.times);
  section("faults", bench.faults);
  section("load_cell", bench.load_cell);
  section("six_axis", bench.six_axis);
  reader.finish();
}

}  // namespace tagwrench::sim
