#include "host/motion/profile_manager.h"

#include <sys/epoll.h>
#include <sys/timerfd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <exception>

#include "host/core/config_error.h"

namespace tagwrench {
namespace {

void add(const UniqueFd& events, int fd) {
  epoll_event wanted{};
  wanted.events = EPOLLIN;
  if (fd >= 0) ::epoll_ctl(events.get(), EPOLL_CTL_ADD, fd, &wanted);
}

Duration period_of(double rate_hz) {
  if (rate_hz <= 0) return {};
  return std::chrono::duration_cast<Duration>(std::chrono::duration<double>(1 / rate_hz));
}

}  // namespace

ProfileManager::ProfileManager(ProfileFiles files, std::optional<ControlSocket> control,
                               std::optional<FocusWatch> focus)
    : files_(std::move(files)),
      control_(std::move(control)),
      focus_(std::move(focus)),
      events_(::epoll_create1(EPOLL_CLOEXEC)),
      gesture_options_(profile().gestures),
      gestures_(gesture_options_),
      shaping_(profile().shaping),
      period_(period_of(profile().rate_hz)) {
  add(events_, files_.fd());
  if (control_) {
    lapse_.reset(::timerfd_create(CLOCK_MONOTONIC, TFD_CLOEXEC | TFD_NONBLOCK));
    add(events_, control_->fd());
    add(events_, lapse_.get());
  }
  if (!events_ || (control_ && !lapse_))
    throw ConfigError(std::string("profiles: no epoll or timer to be had: ") +
                      std::strerror(errno) + "; end other programs");
  if (focus_) {
    add(events_, focus_->fd());
    take_focus();  // what has come already wakes nobody
  }
}

void ProfileManager::shape(Sample& sample) noexcept {
  if (last_program_) take_program();
  const GestureResult gesture = gestures_.feel(sample);
  if (gesture.hold_motion) {
    shaping_.suppress(sample);
  } else {
    shaping_.shape(sample);
  }
  if (carries_numbers(sample.status)) sample.buttons |= gesture.buttons;
  if (gesture.command == GestureCommand::zero) zero_wanted_ = true;
  if (gesture.command == GestureCommand::next_profile)
    use((current_ + 1) % files_.profiles().size(), "by a gesture");
  latest_ = {sample.status, sample.wrench, sample.deflection, sample.buttons};
}

void ProfileManager::service() noexcept {
  try {
    if (files_.fd() >= 0) take_files();
    if (control_) take_requests();
    if (trial_) take_lapse();
    if (focus_) take_focus();
  } catch (const std::exception&) {
    status_line_ = {};  // out of memory: unsaid, and what was in force stays
  }
}

void ProfileManager::take_files() {
  for (const ProfileFiles::Change& change : files_.reread()) {
    if (change.profile == current_) apply();
    status_line_ = change.line;
  }
}

/// A program that no profile is for gets the first one.
void ProfileManager::use_for(std::string_view program) {
  const std::vector<Profile>& all = files_.profiles();
  const auto found =
      std::find_if(all.begin(), all.end(), [&](const Profile& p) { return serves(p, program); });
  use(found == all.end() ? 0 : static_cast<std::size_t>(found - all.begin()), program);
}

void ProfileManager::take_focus() {
  const std::optional<Focus> focus = focus_->changed();
  if (!focus) return;
  focus_told_ = focus->told;
  if (focus->ended) focus_.reset();  // or its descriptor would wake us for ever
  if (focus_told_) {
    use_for(focus->program);
  } else if (!program_.empty()) {
    use_for(program_);
  }
}

void ProfileManager::take_program() noexcept {
  const std::string_view now = last_program_();
  if (now == program_) return;
  try {
    if (program_.empty()) before_programs_ = current_;
    program_ = now;
    if (focus_told_) return;
    if (!program_.empty()) {
      use_for(program_);
    } else {
      use(before_programs_, "the program has gone");
    }
  } catch (const std::exception&) {
    return;  // out of memory: the profile stays
  }
}

void ProfileManager::use(std::size_t profile, std::string_view because) noexcept {
  if (profile == current_) return;
  current_ = profile;
  apply();
  try {
    status_line_ = "profile: " + files_.profiles()[current_].name + " (" + std::string(because) +
                   ")" + (trial_ ? ", which ends a trial" : "");
  } catch (const std::exception&) {
    status_line_ = {};  // out of memory: unsaid
  }
}

void ProfileManager::apply() noexcept {
  shaping_.change(profile().shaping);
  if (profile().gestures !=
      gesture_options_) {  // or a button would be let go in the middle of a click
    gesture_options_ = profile().gestures;
    gestures_ = Gestures(gesture_options_);
  }
  period_ = period_of(profile().rate_hz);
}

}  // namespace tagwrench
