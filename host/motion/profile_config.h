// A profile file -> Profile: how a push becomes motion and a tap a button, for one kind of work.
// The ready-made ones are part of the program.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "host/motion/gestures.h"
#include "host/motion/shaping.h"

namespace tagwrench {

struct Profile {
  std::string name;                       ///< shown to people
  std::vector<std::string> applications;  ///< it is for; see serves()
  ShapingOptions shaping;
  GestureOptions gestures;
  double rate_hz = 125;  ///< of a device's reports; 0: one for every frame
};

/// A ready-made profile or, if there is none of that name, a file. Throws ConfigError:
/// "file:line: key: what is wrong and what to do". Every key may be left out;
/// then it is as the sensor has it or, in brackets, as it stands here:
///
///   name [the file's, without .yaml]
///   applications: [part of a window's class or a program's name, ...]
///   rate_hz [125]                  20 to 125, of reports; 0: one for every frame
///   fill [predict] | none          between frames (host/motion/motion_extrapolator.h)
///   curve [{power: 1}] | {points: [[0, 0], ..., [1, 1]]}     of all axes
///   axes:                          of the device: x y z rx ry rz
///     x: {from [x], invert [false], limit [1], curve,
///         full_scale_n, dead_zone_n | full_scale_nm, dead_zone_nm}     as `from` is a force or not
///   dead_zone_release [0.7]        part of it below which an axis comes to rest again
///   noise_sigmas [8]               of the noise at rest, that a dead zone holds at least
///   swing_ms [120]                 a sudden release's, to 1/e (host/motion/ringdown_suppressor.h);
///   0: it
///                                  counts
///   translation [1], rotation [1]  deflection, times
///   dominant: {on [true], ratio [1.3]}                       only the strongest axis
///   lock [none] | translation | rotation
///   filter: {kind: one_euro, cutoff_hz [2], hz_per_speed [12], speed_cutoff_hz [3]}
///         | {kind: exponential, weight [0.2], at_hz [25]} | {kind: none}
///   gestures:                      each: none, button N, zero, next_profile
///     tap, double_tap, press_hold, twist_left, twist_right [none]
///     tap_force_n, press_force_n, twist_torque_nm, press_ms, hold_motion
///                                  (host/motion/gestures.h)
Profile load_profile(const std::string& name_or_file, const Profile& defaults);
/// The same from the text of `file`.
Profile parse_profile(const std::string& text, const std::string& file, const Profile& defaults);

/// What parse_profile() reads back to the same, over any defaults of the same sensor.
std::string profile_text(const Profile& profile);

/// Whether the profile is meant for a program, by its name or its window's class: one of the
/// profile's applications is part of it, in capitals or not.
bool serves(const Profile& profile, std::string_view application);

struct ReadyProfile {
  std::string name;
  std::string text;
};
const std::vector<ReadyProfile>& ready_profiles();

}  // namespace tagwrench
