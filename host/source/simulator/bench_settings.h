// What is imperfect at the simulated bench: the person, the masses, the reference instruments.
//
// SI units unless the name carries another one. Frames as in host/core/types.h. Every error is
// drawn from the scenario's seed; a plan that states these numbers as its own standard deviations
// is honest about this bench.
#pragma once

#include <Eigen/Core>
#include <array>
#include <limits>
#include <string>

#include "host/core/types.h"

namespace tagwrench {
class YamlReader;
}

namespace tagwrench::sim {

constexpr double kNever = std::numeric_limits<double>::infinity();

/// The person and the masses. All `_error` are standard deviations of seeded normal errors, cut at
/// three of them.
struct BenchErrors {
  double mass = 0.002;          ///< relative; the same each time that the same mass is hung
  double point = 0.2e-3;        ///< of each coordinate of a point, m; the same at each use of it
  double contact = 0.1e-3;      ///< and anew at each use: where in its dimple the load sits, m
  double gravity_rad = 0.0087;  ///< about each of the two axes that matter, anew at each mounting
  double lean_rad = 0.003;      ///< of a string that rubs, about each of two axes, anew at each use
  double string = 0.3e-3;       ///< weight of string and knot, N, anew at each use
  double direction_rad = 0.0087;  ///< of a push, about each of two axes, anew at each push
  double sway_rad = 0.004;        ///< of a push's direction while it lasts, about each of two axes
  double tremor = 0.02;           ///< of a hand's force, relative, at 8 to 12 Hz
};

struct BenchTimes {
  double reaction = 0.4;        ///< s until an order is begun
  double turn = 1.0;            ///< s to mount the sensor another way
  double load = 0.5;            ///< s to hang a mass or to take it off
  double swing_rad = 0.06;      ///< of a mass that has just been let go
  double swing_decay = 0.7;     ///< s after which it swings by a factor e less
  double string_length = 0.12;  ///< m, which gives the swing's frequency
};

/// What goes wrong on purpose, once. Counted from 1; 0: never.
struct BenchFaults {
  int wrong_mass = 0;            ///< this mass, in the order in which they are hung, is another ...
  double wrong_mass_factor = 2;  ///< ... by this factor
  int bump = 0;                  ///< the sensor is knocked at the beginning of this order ...
  Vector6 bump_change = (Vector6() << 20e-6, -15e-6, 30e-6, 1e-3, -5e-4, 4e-4)
                            .finished();  ///< ... so that its rest is elsewhere, m and rad
  int slip = 0;                           ///< a tag slips at the beginning of this order ...
  int slip_tag = 0;                       ///< ... this one (position in target.tags) ...
  Eigen::Vector3d slip_change{60e-6, 40e-6, 0.01};  ///< ... by this, in its plane: m, m, rad
  Vector6 drift_per_hour = Vector6::Zero();         ///< of the rest, m and rad
};

/// What is wrong with a reference instrument.
struct ReferenceFaults {
  double silent_from = kNever;  ///< s
  double silent_to = kNever;    ///< s
  bool wrong_sign = false;      ///< wired the other way round
  double clock_offset = 0;      ///< s added to its times
  double clock_ppm = 0;         ///< its clock is fast by this
};

/// A load cell on an amplifier HX711 at 80 conversions a second.
struct LoadCellSettings {
  bool ideal = false;     ///< no noise, no steps, no lag, no error of scale, no saturation
  double rate = 80;       ///< Hz
  double noise = 0.5e-3;  ///< standard deviation of one conversion, N
  double counts_per_newton = 2.0e5;  ///< whole counts
  double lag = 0.010;                ///< s: a reading stamped t shows t - lag
  double scale_error = 0.002;        ///< standard deviation of its calibration, relative; seeded
  double range = 10;                 ///< N, either way; beyond it is saturated
  ReferenceFaults faults;
};

/// A six-axis sensor under the simulated one, after OptoForce's HEX-58-RE-400N.
struct SixAxisSettings {
  bool ideal = false;  ///< no noise, no steps, no filter, no lag, no saturation, exactly in place
  double rate = 100;   ///< Hz
  std::array<double, 6> counts_per_unit{96.11,   95.64,   20.92,
                                        5425.36, 5524.60, 8103.25};  ///< per N, per N m
  double noise_counts = 1;  ///< standard deviation of a reading, before it becomes whole counts
  double filter_hz = 15;    ///< of its first-order low pass
  double lag = 0.040;       ///< s in all at low frequency, the filter's share of it included
  std::array<double, 6> range{400, 400, 2000, 10, 10, 10};  ///< N, N m; beyond it is saturated
  Eigen::Vector3d origin{0, 0, -0.051};  ///< where its torque counts from, platform frame, m
  double place_error = 0.3e-3;  ///< standard deviation of each coordinate of the origin, m; seeded
  double turn_error = 0.003;    ///< how it is turned about each axis, rad; seeded
  ReferenceFaults faults;
};

struct BenchSettings {
  bool perfect = false;      ///< no errors, no tremor, no swing, ideal references; faults stay
  double gravity = 9.80665;  ///< m/s^2
  BenchErrors errors;
  BenchTimes times;
  BenchFaults faults;
  LoadCellSettings load_cell;
  SixAxisSettings six_axis;
};

/// The first thing wrong with the settings at a target of `tags` tags ("bench.times: ...", what and
/// what to do), or an empty string.
std::string problem(const BenchSettings& settings, int tags);

// The section `bench` of scenario.yaml -> BenchSettings: the simulated person, masses and
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

/// Throws ConfigError with file, line and key.
void read_bench(YamlReader reader, BenchSettings& bench);

}  // namespace tagwrench::sim
