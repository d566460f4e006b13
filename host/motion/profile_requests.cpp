// What the desk answers to requests.
#include <sys/timerfd.h>
#include <unistd.h>

#include <algorithm>
#include <exception>

#include "host/core/config_error.h"
#include "host/motion/profile_manager.h"

namespace tagwrench {
namespace {

constexpr int kRequestsAtOnce = 8;  // the others wait until the next picture has been seen to
constexpr timespec kTrialPatience = {3, 0};  // who tries asks twenty times a second

}  // namespace

void ProfileManager::take_requests() {
  for (int i = 0; i < kRequestsAtOnce; ++i) {
    const ControlRequest request = control_->next();
    if (request.kind == ControlRequest::Kind::none) return;
    if (asker_tries()) extend_trial();
    control_->answer(granted(request));
    if (request.kind == ControlRequest::Kind::attempt) return;  // a profile's text takes longest
  }
}

std::string ProfileManager::granted(const ControlRequest& request) {
  using Kind = ControlRequest::Kind;
  switch (request.kind) {
    case Kind::none:
      return {};
    case Kind::zero:
      zero_wanted_ = true;
      return "ok: as soon as nobody touches the sensor\n";
    case Kind::next_profile:
      use((current_ + 1) % files_.profiles().size(), "as asked");
      return "ok: " + files_.profiles()[current_].name + "\n";
    case Kind::profile:
      return choose(request.name);
    case Kind::status: {
      std::string line = "ok: profile " + profile().name + " of";
      for (const Profile& p : files_.profiles()) line += " " + p.name;
      return line + "\n";
    }
    case Kind::window:
      return window(request.name);
    case Kind::live:
      return live();
    case Kind::show:
      return show(request.name);
    case Kind::attempt:
      return attempt(request);
    case Kind::keep:
      return keep();
    case Kind::revert:
      return revert();
    case Kind::unknown:
      break;
  }
  return "error: requests are zero, next, profile NAME, window NAME, status, live and show NAME\n";
}

std::optional<std::size_t> ProfileManager::find(std::string_view name) const noexcept {
  const std::vector<Profile>& all = files_.profiles();
  const auto found =
      std::find_if(all.begin(), all.end(), [&](const Profile& p) { return p.name == name; });
  if (found == all.end()) return {};
  return static_cast<std::size_t>(found - all.begin());
}

std::string ProfileManager::unknown(std::string_view name) const {
  std::string known;
  for (const Profile& p : files_.profiles()) known += (known.empty() ? "" : ", ") + p.name;
  return "error: no profile '" + std::string(name) + "'; there are " + known + "\n";
}

std::string ProfileManager::choose(std::string_view name) {
  const std::optional<std::size_t> found = find(name);
  if (!found) return unknown(name);
  use(*found, "as asked");
  return "ok: " + files_.profiles()[current_].name + "\n";
}

/// As if the desktop itself had told it. Without a name: nobody knows any more.
std::string ProfileManager::window(std::string_view program) {
  focus_told_ = !program.empty();
  if (focus_told_) {
    use_for(program);
  } else if (!program_.empty()) {
    use_for(program_);
  }
  return "ok: " + files_.profiles()[current_].name + "\n";
}

std::string ProfileManager::live() const {
  LiveReading now = latest_;
  now.on_trial = asker_tries();
  return live_text(now);
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

/// Answers what becomes of the text, as show() does; it may leave out things.
std::string ProfileManager::attempt(const ControlRequest& request) {
  if (control_->asker().empty()) return "error: who tries a profile needs an address\n";
  if (trial_ && !asker_tries())
    return "error: another page tries profile " + trial_->profile.name + "; leave that one first\n";
  const std::optional<std::size_t> found = find(request.name);
  if (!found) return unknown(request.name);
  try {
    Profile tried = files_.parse(std::string(request.text), *found);
    tried.name = files_.profiles()[*found].name;
    std::string answer = "ok: " + files_.file_of(*found) + "\n" + profile_text(tried);
    if (answer.size() > ControlSocket::kMaxAnswer) return "error: too long to be tried\n";
    trial_ = {*found, std::move(tried), std::string(control_->asker())};
    apply();
    extend_trial();
    return answer;
  } catch (const ConfigError& e) {
    return "error: " + std::string(e.what()) + "\n";
  }
}

std::string ProfileManager::keep() {
  if (!asker_tries()) return "error: nothing of yours is on trial\n";
  files_.replace(trial_->of, trial_->profile);
  status_line_ = "profile " + trial_->profile.name + ": as tuned, until this run ends";
  return "ok: " + trial_->profile.name + "\n";
}

std::string ProfileManager::revert() {
  if (!asker_tries()) return "error: nothing of yours is on trial\n";
  end_trial();
  return "ok: " + profile().name + "\n";
}

bool ProfileManager::asker_tries() const noexcept {
  return trial_ && !trial_->owner.empty() && trial_->owner == control_->asker();
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

}  // namespace tagwrench
