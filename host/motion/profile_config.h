// A profile file -> Profile: how a push becomes motion and a tap a button, for one kind of work.
// The ready-made ones are part of the program.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "host/core/os/unique_fd.h"
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
///   fill [predict] | none          between frames (MotionExtrapolator)
///   curve [{power: 1}] | {points: [[0, 0], ..., [1, 1]]}     of all axes
///   axes:                          of the device: x y z rx ry rz
///     x: {from [x], invert [false], limit [1], curve,
///         full_scale_n, dead_zone_n | full_scale_nm, dead_zone_nm}     as `from` is a force or not
///   dead_zone_release [0.7]        part of it below which an axis comes to rest again
///   noise_sigmas [8]               of the noise at rest, that a dead zone holds at least
///   swing_ms [120]                 a sudden release's, to 1/e (RingdownSuppressor); 0: it counts
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

// Profiles, ready-made or on disk; those on disk are read again when somebody saves them.

class ProfileFiles {
 public:
  /// `chosen`: names of ready-made profiles, files, and folders of *.yaml, which come in the order
  /// of their names. None: what the sensor itself says. Throws ConfigError: there is no such
  /// profile, two have one name, or the first fault in a file.
  ProfileFiles(const std::vector<std::string>& chosen, Profile defaults);

  /// At least one.
  const std::vector<Profile>& profiles() const noexcept { return profiles_; }
  /// Where a profile is on disk; empty if it is not.
  std::string file_of(std::size_t profile) const {
    for (const File& file : files_)
      if (file.profile == profile) return file.folder + "/" + file.name;
    return {};
  }
  /// What a profile's text leaves out.
  const Profile& defaults() const noexcept { return defaults_; }
  /// Until its file is saved again.
  void replace(std::size_t profile, Profile by) { profiles_[profile] = std::move(by); }

  /// Readable when a file may have changed; -1: none is on disk.
  int fd() const noexcept { return watch_.get(); }

  struct Change {
    std::optional<std::size_t>
        profile;       ///< that is new; none: the file is wrong, the earlier stays
    std::string line;  ///< for people
  };
  /// Reads again what has changed, if fd() is readable. A file that is gone leaves what it said.
  std::vector<Change> reread();

 private:
  struct File {
    std::string folder;
    std::string name;
    std::string text;  ///< as it was read last
    std::size_t profile = 0;
  };
  void take(const std::string& path);
  void watch();
  Profile checked(const std::string& text, const std::string& path) const;
  std::optional<Change> look_again(File& file);

  Profile defaults_;
  std::vector<Profile> profiles_;
  std::vector<File> files_;
  UniqueFd watch_;
};

}  // namespace tagwrench
