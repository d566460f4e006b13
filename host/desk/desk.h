// What the person at the desk has chosen, and what it makes of newtons: the profile in force, its
// shaping and gestures, and how it changes while the sensor runs.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include "host/desk/control_socket.h"
#include "host/desk/focus_watch.h"
#include "host/desk/profile_files.h"
#include "host/os/unique_fd.h"
#include "host/types.h"
#include "host/wrench/gestures.h"
#include "host/wrench/shaping.h"
#include "host/wrench/zero.h"

namespace tagwrench {

class Desk {
 public:
  /// The sensor's own shaping, for good.
  explicit Desk(const SensorConfig& sensor) : Desk(ProfileFiles({}, sensor), {}, {}) {}
  /// The first profile is in force until somebody says otherwise. Throws ConfigError if the system
  /// has no more descriptors.
  Desk(ProfileFiles files, std::optional<ControlSocket> control, std::optional<FocusWatch> focus);

  /// Fills sample.motion, and adds what gestures press to sample.buttons. No heap, unless a gesture
  /// changes the profile.
  void shape(Sample& sample) noexcept;
  /// The sample's motion at a later time, on the clock of its capture time.
  void move_on(Sample& sample, TimePoint time) const noexcept {
    sample.motion = shaping_.motion_at(time);
  }
  /// Between two moves of a device; zero: it moves with every sample.
  Duration period() const noexcept { return period_; }

  /// Whether a gesture or a command has asked since the last call that what reads now be nothing.
  bool take_zero() noexcept { return std::exchange(zero_wanted_, false); }
  /// What has changed since the last call, a line for people; empty: nothing.
  std::string take_news() noexcept { return std::exchange(news_, {}); }

  /// Readable when service() has something to do.
  int poll_fd() const noexcept { return events_.get(); }
  /// Changed files, wishes, the focus.
  void service() noexcept;

  const Profile& profile() const noexcept { return files_.profiles()[current_]; }

 private:
  void use(std::size_t profile, std::string_view because) noexcept;
  void apply() noexcept;
  void take_files();
  void take_wishes();
  void take_focus();
  std::string granted(const ControlWish& wish);

  ProfileFiles files_;
  std::optional<ControlSocket> control_;
  std::optional<FocusWatch> focus_;
  UniqueFd events_;  ///< epoll of the three
  std::size_t current_ = 0;
  GestureOptions gesture_options_;
  Gestures gestures_;
  Shaping shaping_;
  Duration period_{};
  bool zero_wanted_ = false;
  std::string news_;
};

/// What became of a zero on demand, in words; empty for none.
std::string_view zero_text(ZeroAnswer answer) noexcept;

}  // namespace tagwrench
