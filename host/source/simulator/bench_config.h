// The section `bench` of scenario.yaml -> sim::BenchSettings: the simulated person, masses and
// reference instruments of a calibration. Keys are the fields of bench_settings.h, with the unit
// after the name; all may be left out.
//
//   bench:
//     perfect: false
//     gravity: 9.80665
//     errors: {mass_percent: 0.2, point_mm: 0.2, contact_mm: 0.1, gravity_rad: 0.0087,
//              lean_rad: 0.003, string_mn: 0.3, direction_rad: 0.0087, sway_rad: 0.004,
//              tremor: 0.02}
//     times: {reaction_s: 0.4, turn_s: 1, load_s: 0.5, swing_rad: 0.06, swing_decay_s: 0.7,
//             string_mm: 120}
//     faults: {wrong_mass: 0, wrong_mass_factor: 2, bump: 0, bump_change: [x, y, z, rx, ry, rz],
//              slip: 0, slip_tag: 0, slip_change: [x, y, rz], drift_per_hour: [six]}   # m and rad
//     load_cell: {ideal: false, rate_hz: 80, noise_mn: 0.5, counts_per_newton: 200000, lag_ms: 10,
//                 scale_error_percent: 0.2, range_n: 10}
//     six_axis: {ideal: false, rate_hz: 100, counts_per_unit: [six], noise_counts: 1,
//                filter_hz: 15, lag_ms: 40, range: [six], origin_mm: [0, 0, -51],
//                place_error_mm: 0.3, turn_error_rad: 0.003}
//     # and of both: silent_from_s, silent_to_s, wrong_sign, clock_offset_s, clock_ppm
#pragma once

#include "host/core/yaml/yaml_reader.h"
#include "host/source/simulator/bench_settings.h"

namespace tagwrench {

/// Throws ConfigError with file, line and key.
void read_bench(YamlReader reader, sim::BenchSettings& bench);

}  // namespace tagwrench
