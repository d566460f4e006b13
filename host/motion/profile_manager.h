// Room motion: newtons -> what an input device shows.
// In:  Sample with its wrench, N and N m; profiles; requests; which program has the focus.
// Out: Sample::deflection, -1..1 on the HID axes (X right, Y toward the user, Z down), and buttons.
//      At rest it is exactly zero. Formats and figures: docs/profiles.md.
// Then: shaping.h (one frame's way), gestures.h, profile_config.h.
//
// What the person at the desk has chosen, and what it makes of newtons: the profile in force, its
// shaping and gestures, and how it changes while the sensor runs.
#pragma once

#include <cstddef>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include "host/core/os/unique_fd.h"
#include "host/core/types.h"
#include "host/motion/control_socket.h"
#include "host/motion/focus_watch.h"
#include "host/motion/gestures.h"
#include "host/motion/profile_config.h"
#include "host/motion/shaping.h"
#include "host/motion/trial_reader.h"
#include "host/wrench/zero.h"

namespace tagwrench {

// What the sensor reads now, as one line of text: for who watches while a profile is tuned.

struct LiveReading {
  Status status = Status::acquiring;
  Vector6 wrench = Vector6::Zero();  ///< N, N m
  Vector6 motion = Vector6::Zero();  ///< -1..1 per HID axis
  std::uint32_t buttons = 0;
  bool on_trial = false;  ///< of who asks: his profile is in force
};

/// "ok: STATUS, wrench, motion, buttons, 0 or 1", separated by blanks.
std::string live_text(const LiveReading& reading);
/// Nothing, if the text is none of live_text().
std::optional<LiveReading> parse_live(std::string_view text);

class ProfileManager {
 public:
  /// The sensor's own shaping, for good.
  explicit ProfileManager(const Profile& defaults)
      : ProfileManager(ProfileFiles({}, defaults), {}, {}) {}
  /// The first profile is in force until somebody says otherwise. ConfigError: no more descriptors.
  ProfileManager(ProfileFiles files, std::optional<ControlSocket> control,
                 std::unique_ptr<FocusWatch> focus);

  /// Where the focus is not known, the program chooses that connected last: `last_program` gives
  /// its name, empty if none is connected, and is asked with every sample.
  void follow_programs(std::function<std::string_view()> last_program) {
    last_program_ = std::move(last_program);
  }

  /// Fills sample.deflection, and adds what gestures press to sample.buttons. No heap, unless a
  /// gesture changes the profile.
  void shape(Sample& sample) noexcept;
  /// The sample's motion at a later time, on the clock of its capture time.
  void move_on(Sample& sample, TimePoint time) const noexcept {
    sample.deflection = shaping_.motion_at(time);
  }
  /// Between two moves of a device; zero: it moves with every sample.
  Duration period() const noexcept { return period_; }

  /// Whether a gesture or a command has asked since the last call that what reads now be nothing.
  bool take_zero() noexcept { return std::exchange(zero_wanted_, false); }
  /// What has changed since the last call, a line for people; empty: nothing.
  std::string take_status_line() noexcept { return std::exchange(status_line_, {}); }

  /// Readable when service() has something to do.
  int poll_fd() const noexcept { return events_.get(); }
  /// Changed files, requests, the focus.
  void service() noexcept {
    if (files_.fd() >= 0) take_files();
    if (reader_) take_reading();
    if (control_) take_requests();
    if (trial_) take_lapse();
    if (focus_) take_focus();
  }

  /// In force: the one on trial, else the one chosen.
  const Profile& profile() const noexcept {
    return trial_ ? trial_->profile : files_.profiles()[current_];
  }

 private:
  /// What somebody tries at a page. It ends when he does not ask for a while: he is gone.
  struct Trial {
    std::size_t of = 0;  ///< the profile that it stands for
    Profile profile;
    std::string owner;  ///< ControlSocket::asker()
  };

  void use(std::size_t profile, std::string_view because) noexcept;
  void use_for(std::string_view program);
  void apply() noexcept;
  void take_files();
  void take_requests();
  void take_reading();
  void take_focus();
  void follow_focus(bool told, std::string_view program);
  void take_program() noexcept;
  void take_lapse();
  std::string granted(const ControlRequest& request);
  std::string show(std::string_view name) const;
  std::string attempt(const ControlRequest& request);
  std::optional<std::size_t> find(std::string_view name) const noexcept;
  std::string unknown(std::string_view name) const;
  bool asker_tries() const noexcept { return tries(control_->asker()); }
  bool tries(std::string_view asker) const noexcept {
    return trial_ && !asker.empty() && trial_->owner == asker;
  }
  std::string another_tries() const;
  void extend_trial() noexcept;
  void end_trial() noexcept;

  ProfileFiles files_;
  std::optional<ControlSocket> control_;
  std::unique_ptr<FocusWatch> focus_;
  UniqueFd lapse_;  ///< timer: a trial's end
  std::unique_ptr<TrialReader> reader_;
  UniqueFd events_;  ///< epoll of them all
  std::size_t current_ = 0;
  std::optional<Trial> trial_;
  GestureOptions gesture_options_;
  Gestures gestures_;
  Shaping shaping_;
  Duration period_{};
  bool focus_told_ = false;
  std::function<std::string_view()> last_program_;
  std::string program_;              ///< the last that it gave
  std::size_t before_programs_ = 0;  ///< the profile in force before there was one
  LiveReading latest_;
  bool zero_wanted_ = false;
  std::string status_line_;
};

}  // namespace tagwrench
