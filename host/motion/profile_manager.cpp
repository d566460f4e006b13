#include "host/motion/profile_manager.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <sys/epoll.h>
#include <sys/timerfd.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <sstream>

#include "host/core/config_error.h"
#include "host/core/os/remedy.h"

namespace tagwrench {
namespace {

[[noreturn]] void no_descriptor(int error) {
  throw ConfigError("profiles: no epoll or timer to be had: {}; {}", std::strerror(error),
                    remedy_for(error, "end other programs"));
}

UniqueFd event_set() {
  UniqueFd made(::epoll_create1(EPOLL_CLOEXEC));
  if (!made) no_descriptor(errno);
  return made;
}

UniqueFd lapse_timer() {
  UniqueFd made(::timerfd_create(CLOCK_MONOTONIC, TFD_CLOEXEC | TFD_NONBLOCK));
  if (!made) no_descriptor(errno);
  return made;
}

void add(const UniqueFd& events, int fd) {
  epoll_event wanted{};
  wanted.events = EPOLLIN;
  if (fd >= 0) ::epoll_ctl(events.get(), EPOLL_CTL_ADD, fd, &wanted);
}

Duration period_of(double rate_hz) {
  if (rate_hz <= 0) return {};
  return std::chrono::duration_cast<Duration>(std::chrono::duration<double>(1 / rate_hz));
}

constexpr int kRequestsAtOnce = 8;  // the others wait until the next picture has been seen to
// Whoever tries asks once a second or more often; on a busy machine, later.
constexpr timespec kTrialPatience = {10, 0};

constexpr std::string_view kHead = "ok: ";
}  // namespace

ProfileManager::ProfileManager(ProfileFiles files, std::optional<ControlSocket> control,
                               std::unique_ptr<FocusWatch> focus)
    : files_(std::move(files)),
      control_(std::move(control)),
      focus_(std::move(focus)),
      events_(event_set()),
      gesture_options_(profile().gestures),
      gestures_(gesture_options_),
      shaping_(profile().shaping),
      period_(period_of(profile().rate_hz)) {
  add(events_, files_.fd());
  if (control_) {
    lapse_ = lapse_timer();
    reader_ = std::make_unique<TrialReader>();
    add(events_, reader_->fd());
    add(events_, control_->fd());
    add(events_, lapse_.get());
  }
  if (focus_) {
    add(events_, focus_->fd());
    take_focus();  // what has come already wakes nobody
  }
}

void ProfileManager::shape(Sample& sample) noexcept {
  if (last_program_) take_program();
  const GestureResult gesture = gestures_.feel(sample);
  if (gesture.hold_motion)
    shaping_.suppress(sample);
  else
    shaping_.shape(sample);
  if (carries_numbers(sample.status)) sample.buttons |= gesture.buttons;
  if (gesture.command == GestureCommand::zero) zero_wanted_ = true;
  if (gesture.command == GestureCommand::next_profile)
    use((current_ + 1) % files_.profiles().size(), "by a gesture");
  latest_ = {sample.status, sample.wrench, sample.deflection, sample.buttons};
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
  const auto found = std::ranges::find_if(all, [&](auto& p) { return serves(p, program); });
  use(found == all.end() ? 0 : static_cast<std::size_t>(found - all.begin()), program);
}

void ProfileManager::take_focus() {
  const std::optional<Focus> focus = focus_->changed();
  if (!focus) return;
  if (focus->ended) focus_.reset();  // or its descriptor would wake us for ever
  follow_focus(focus->told, focus->program);
}

/// Where the focus is not known, the program decides that connected last.
void ProfileManager::follow_focus(bool told, std::string_view program) {
  focus_told_ = told;
  if (told)
    use_for(program);
  else if (!program_.empty())
    use_for(program_);
}

void ProfileManager::take_program() noexcept {
  const std::string_view now = last_program_();
  if (now == program_) return;
  if (program_.empty()) before_programs_ = current_;
  program_ = now;
  if (focus_told_) return;
  if (!program_.empty())
    use_for(program_);
  else
    use(before_programs_, "the program has gone");
}

void ProfileManager::use(std::size_t profile, std::string_view because) noexcept {
  if (profile == current_) return;
  current_ = profile;
  apply();
  status_line_ = fmt::format("profile: {} ({}){}", files_.profiles()[current_].name, because,
                             trial_ ? ", which ends a trial" : "");
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

void ProfileManager::take_requests() {
  for (int i = 0; i < kRequestsAtOnce; ++i) {
    const ControlRequest request = control_->next();
    if (request.kind == ControlRequest::Kind::none) return;
    if (asker_tries()) extend_trial();
    if (const std::string answer = granted(request); !answer.empty()) control_->answer(answer);
  }
}

std::string ProfileManager::granted(const ControlRequest& request) {
  using Kind = ControlRequest::Kind;
  const auto chosen = [this] { return "ok: " + files_.profiles()[current_].name + "\n"; };
  constexpr const char* kNoTrial = "error: nothing of yours is on trial\n";
  switch (request.kind) {
    case Kind::none: return {};
    case Kind::zero: zero_wanted_ = true; return "ok: as soon as nobody touches the sensor\n";
    case Kind::next_profile:
      use((current_ + 1) % files_.profiles().size(), "as asked");
      return chosen();
    case Kind::profile: {
      const std::optional<std::size_t> found = find(request.name);
      if (!found) return unknown(request.name);
      use(*found, "as asked");
      return chosen();
    }
    case Kind::status: {
      std::string line = "ok: profile " + profile().name + " of";
      for (const Profile& p : files_.profiles()) line += " " + p.name;
      return line + "\n";
    }
    case Kind::window:  // as if the desktop had told it; without a name: nobody knows any more
      follow_focus(!request.name.empty(), request.name);
      return chosen();
    case Kind::live: {
      LiveReading now = latest_;
      now.on_trial = asker_tries();
      return live_text(now);
    }
    case Kind::show: return show(request.name);
    case Kind::attempt: return attempt(request);
    case Kind::keep:
      if (!asker_tries()) return kNoTrial;
      files_.replace(trial_->of, trial_->profile);
      status_line_ = "profile " + trial_->profile.name + ": as tuned, until this run ends";
      return "ok: " + trial_->profile.name + "\n";
    case Kind::revert:
      if (!asker_tries()) return kNoTrial;
      end_trial();
      return "ok: " + profile().name + "\n";
    case Kind::unknown: break;
  }
  return "error: requests are zero, next, profile NAME, window NAME, status, live and show NAME\n";
}

std::optional<std::size_t> ProfileManager::find(std::string_view name) const noexcept {
  const auto found = std::ranges::find(files_.profiles(), name, &Profile::name);
  if (found == files_.profiles().end()) return {};
  return static_cast<std::size_t>(found - files_.profiles().begin());
}

std::string ProfileManager::unknown(std::string_view name) const {
  std::string known;
  for (const Profile& p : files_.profiles()) known += (known.empty() ? "" : ", ") + p.name;
  return "error: no profile '" + std::string(name) + "'; there are " + known + "\n";
}

/// "ok: FILE", or "ok: " where there is none, and the profile with all that it leaves out.
std::string ProfileManager::show(std::string_view name) const {
  const std::optional<std::size_t> found = name.empty() ? current_ : find(name);
  if (!found) return unknown(name);
  std::string text =
      "ok: " + files_.file_of(*found) + "\n" + profile_text(files_.profiles()[*found]);
  if (text.size() > ControlSocket::kMaxAnswer) return "error: too long to be told\n";
  return text;
}

std::string ProfileManager::another_tries() const {
  return "error: another page tries profile " + trial_->profile.name + "; leave that one first\n";
}

/// Is answered when the text has been read.
std::string ProfileManager::attempt(const ControlRequest& request) {
  if (control_->asker().empty()) return "error: who tries a profile needs an address\n";
  if (trial_ && !asker_tries()) return another_tries();
  const std::optional<std::size_t> found = find(request.name);
  if (!found) return unknown(request.name);
  const bool taken = reader_->read({.asker = std::string(control_->asker()),
                                    .profile = *found,
                                    .name = files_.profiles()[*found].name,
                                    .file = files_.file_of(*found),
                                    .text = std::string(request.text),
                                    .defaults = files_.defaults()});
  return taken ? "" : "error: another text is being read; try again\n";
}

void ProfileManager::take_reading() {
  std::optional<TrialReader::Reading> reading = reader_->take();
  if (!reading) return;
  if (trial_ && !tries(reading->asker)) {
    reading->answer = another_tries();
  } else if (reading->read) {
    trial_ = {reading->profile, *std::move(reading->read), reading->asker};
    apply();
    extend_trial();
  }
  control_->answer(reading->asker, reading->answer);
}

void ProfileManager::extend_trial() noexcept {
  const itimerspec once{{}, kTrialPatience};
  ::timerfd_settime(lapse_.get(), 0, &once, nullptr);
}

void ProfileManager::end_trial() noexcept {
  trial_.reset();
  const itimerspec never{};
  ::timerfd_settime(lapse_.get(), 0, &never, nullptr);
  apply();
}

void ProfileManager::take_lapse() {
  std::uint64_t times = 0;
  if (::read(lapse_.get(), &times, sizeof times) < 0) return;
  const std::string name = trial_->profile.name;
  end_trial();
  status_line_ = "profile " + name + ": who tried it has gone, what was saved is in force again";
}

std::string live_text(const LiveReading& reading) {
  return fmt::format("{}{} {:g} {:g} {} {:d}\n", kHead, name(reading.status),
                     fmt::join(reading.wrench, " "), fmt::join(reading.motion, " "),
                     reading.buttons, reading.on_trial);
}

std::optional<LiveReading> parse_live(std::string_view text) {
  if (!text.starts_with(kHead) || !text.ends_with('\n')) return {};
  std::istringstream words(std::string(text.substr(kHead.size())));
  std::string status, more;
  LiveReading reading;
  words >> status;
  for (Vector6* six : {&reading.wrench, &reading.motion})
    for (double& value : *six) words >> value;
  words >> reading.buttons >> reading.on_trial;
  constexpr std::array kStatuses = {Status::ok, Status::acquiring, Status::lost, Status::doubtful,
                                    Status::saturated};
  const auto* known =
      std::ranges::find_if(kStatuses, [&](Status one) { return status == name(one); });
  if (!words || words >> more || known == kStatuses.end()) return {};
  reading.status = *known;
  return reading;
}

}  // namespace tagwrench
