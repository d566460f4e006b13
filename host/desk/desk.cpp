#include "host/desk/desk.h"

#include <sys/epoll.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <exception>

#include "host/config_error.h"

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

Desk::Desk(ProfileFiles files, std::optional<ControlSocket> control,
           std::optional<FocusWatch> focus)
    : files_(std::move(files)),
      control_(std::move(control)),
      focus_(std::move(focus)),
      events_(::epoll_create1(EPOLL_CLOEXEC)),
      gesture_options_(profile().gestures),
      gestures_(gesture_options_),
      shaping_(profile().shaping),
      period_(period_of(profile().rate_hz)) {
  if (!events_)
    throw ConfigError(std::string("profiles: no epoll to be had: ") + std::strerror(errno) +
                      "; end other programs");
  add(events_, files_.fd());
  if (control_) add(events_, control_->fd());
  if (focus_) add(events_, focus_->fd());
}

void Desk::shape(Sample& sample) noexcept {
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
}

void Desk::service() noexcept {
  try {
    if (files_.fd() >= 0) take_files();
    if (control_) take_wishes();
    if (focus_) take_focus();
  } catch (const std::exception&) {
    news_ = {};  // out of memory: unsaid, and what was in force stays
  }
}

void Desk::take_files() {
  for (const ProfileFiles::Change& change : files_.reread()) {
    if (change.profile == current_) apply();
    news_ = change.line;
  }
}

void Desk::take_wishes() {
  while (true) {
    const ControlWish wish = control_->next();
    if (wish.kind == ControlWish::Kind::none) return;
    control_->answer(granted(wish));
  }
}

std::string Desk::granted(const ControlWish& wish) {
  using Kind = ControlWish::Kind;
  const std::vector<Profile>& all = files_.profiles();
  switch (wish.kind) {
    case Kind::none:
      return {};
    case Kind::zero:
      zero_wanted_ = true;
      return "ok: as soon as nobody touches the sensor\n";
    case Kind::next_profile:
      use((current_ + 1) % all.size(), "as asked");
      return "ok: " + profile().name + "\n";
    case Kind::profile: {
      const auto found = std::find_if(all.begin(), all.end(),
                                      [&](const Profile& p) { return p.name == wish.name; });
      if (found != all.end()) {
        use(static_cast<std::size_t>(found - all.begin()), "as asked");
        return "ok: " + profile().name + "\n";
      }
      std::string known;
      for (const Profile& p : all) known += (known.empty() ? "" : ", ") + p.name;
      return "error: no profile '" + std::string(wish.name) + "'; there are " + known + "\n";
    }
    case Kind::status: {
      std::string line = "ok: profile " + profile().name + " of";
      for (const Profile& p : all) line += " " + p.name;
      return line + "\n";
    }
    case Kind::unknown:
      break;
  }
  return "error: wishes are zero, next, profile NAME and status\n";
}

/// A program that no profile is for gets the first one.
void Desk::take_focus() {
  const std::optional<std::string> program = focus_->changed();
  if (!program) return;
  const std::vector<Profile>& all = files_.profiles();
  const auto found =
      std::find_if(all.begin(), all.end(), [&](const Profile& p) { return serves(p, *program); });
  use(found == all.end() ? 0 : static_cast<std::size_t>(found - all.begin()), *program);
}

void Desk::use(std::size_t profile, std::string_view because) noexcept {
  if (profile == current_) return;
  current_ = profile;
  apply();
  try {
    news_ = "profile: " + files_.profiles()[current_].name + " (" + std::string(because) + ")";
  } catch (const std::exception&) {
    news_ = {};  // out of memory: unsaid
  }
}

void Desk::apply() noexcept {
  shaping_.change(profile().shaping);
  if (profile().gestures !=
      gesture_options_) {  // or a button would be let go in the middle of a click
    gesture_options_ = profile().gestures;
    gestures_ = Gestures(gesture_options_);
  }
  period_ = period_of(profile().rate_hz);
}

std::string_view zero_text(ZeroAnswer answer) noexcept {
  switch (answer) {
    case ZeroAnswer::none:
      return {};
    case ZeroAnswer::done:
      return "zero: what read is nothing now";
    case ZeroAnswer::loaded:
      return "zero: refused, something presses on the platform; take it off, or run `tagwrench "
             "zero`";
    case ZeroAnswer::moving:
      return "zero: refused, the platform did not come to rest; let go of it";
    case ZeroAnswer::no_range:
      return "zero: refused, the sensor's range is not known; give wrench.range_n in sensor.yaml";
  }
  return {};
}

}  // namespace tagwrench
