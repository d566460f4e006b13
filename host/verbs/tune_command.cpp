#include "host/verbs/tune_command.h"

#include <poll.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <exception>
#include <filesystem>
#include <optional>

#include "host/config/sensor_edit.h"
#include "host/config_error.h"
#include "host/desk/control_socket.h"
#include "host/desk/live.h"
#include "host/os/termination.h"
#include "host/verbs/tune/tuning.h"
#include "host/verbs/tune/tuning_screen.h"
#include "host/verbs/tune/tuning_view.h"

namespace tagwrench {
namespace {

constexpr Duration kPeriod = std::chrono::milliseconds(50);  // of what is seen

/// A profile as the sensor tells it.
struct Told {
  std::string file;  ///< empty: it has none
  Profile profile;
};

/// Of "ok: FILE", and the profile's text from the next line on. Throws ConfigError: the sensor
/// refuses, and why.
Told told_in(const std::string& answer) {
  constexpr std::string_view kDone = "ok: ";
  const std::size_t line_end = std::min(answer.find('\n'), answer.size());
  const std::string line = answer.substr(0, line_end);
  if (!line.starts_with(kDone) || line_end == answer.size()) {
    constexpr std::string_view kError = "error: ";
    throw ConfigError(line.starts_with(kError) ? line.substr(kError.size()) : line);
  }
  return {line.substr(kDone.size()),
          parse_profile(answer.substr(line_end + 1), "the sensor's answer", Profile{})};
}

/// What a profile is made from: its file, the ready-made one's text, or nothing but its name.
std::string text_of(const Told& told) {
  if (!told.file.empty()) return read_text(told.file);
  for (const ReadyProfile& ready : ready_profiles()) {
    if (ready.name == told.profile.name) return ready.text;
  }
  return "name: " + told.profile.name + "\n";
}

std::string attempt_wish(const std::string& name, const std::string& text) {
  return "try " + name + "\n" + text;
}

void check_new(const std::string& file) {
  std::error_code none;
  if (std::filesystem::exists(file, none))
    throw ConfigError(file + ": is there already; give --out a new name");
}

class TuneSession {
 public:
  TuneSession(const std::string& path, const std::string& profile, const std::string& out);

  /// Until somebody leaves.
  void run();

 private:
  void take_keys();
  void do_it(Tuning::Wish wish);
  void attempt();
  void save();
  void look();
  std::optional<std::string> ask(std::string_view wish);

  std::string path_;
  std::optional<ControlClient> sensor_;
  std::optional<Tuning> tuning_;
  UniqueFd stop_ = termination_fd();
  std::optional<TuningScreen> screen_;
  LiveReading now_;
  bool over_ = false;
};

TuneSession::TuneSession(const std::string& path, const std::string& profile,
                         const std::string& out)
    : path_(path), sensor_(std::in_place, path) {
  const Told as_it_is = told_in(sensor_->ask("show " + profile));
  const std::string name = as_it_is.profile.name;
  const std::string text = text_of(as_it_is);
  if (!out.empty()) check_new(out);
  screen_.emplace();
  const Told as_saved = told_in(sensor_->ask(attempt_wish(name, text)));
  tuning_.emplace(
      TuningSource{name, out.empty() ? as_it_is.file : out, !out.empty(), text, as_saved.profile});
  do_it(tuning_->start_from(as_it_is.profile));
}

void TuneSession::run() {
  TimePoint next_look{};
  while (!over_) {
    const TimePoint now = std::chrono::steady_clock::now();
    if (now >= next_look) {
      look();
      screen_->show(tuning_view(*tuning_, now_, screen_->width(), screen_->height()));
      next_look = std::chrono::steady_clock::now() + kPeriod;
    }
    const auto left = std::chrono::duration_cast<std::chrono::milliseconds>(
        next_look - std::chrono::steady_clock::now());
    pollfd fds[2] = {{STDIN_FILENO, POLLIN, 0}, {stop_.get(), POLLIN, 0}};
    if (::poll(fds, 2, std::max(0, static_cast<int>(left.count()) + 1)) <= 0) continue;
    if (fds[1].revents != 0) break;
    if (fds[0].revents != 0) take_keys();
    next_look = {};  // what a key does is seen at once
  }
  ask("revert");
}

void TuneSession::take_keys() {
  const std::string bytes = screen_->read();
  over_ = bytes.empty();
  for (const Key key : keys_in(bytes)) do_it(tuning_->press(key));
}

void TuneSession::do_it(Tuning::Wish wish) {
  if (wish == Tuning::Wish::attempt) attempt();
  if (wish == Tuning::Wish::save) save();
  if (wish == Tuning::Wish::leave) over_ = true;
}

void TuneSession::attempt() {
  const std::optional<std::string> answer = ask(attempt_wish(tuning_->name(), tuning_->text()));
  if (!answer) return;
  try {
    tuning_->granted(told_in(*answer).profile);
  } catch (const ConfigError& e) {
    tuning_->refused(e.what());
  }
}

void TuneSession::save() {
  const bool new_file = tuning_->new_file();
  try {
    if (new_file) {
      check_new(tuning_->file());
    } else if (read_text(tuning_->file()) != tuning_->saved_text()) {
      throw ConfigError(tuning_->file() +
                        ": somebody else has changed it; leave, and tune that one");
    }
    write_atomically(tuning_->file(), tuning_->text());
  } catch (const std::exception& e) {
    tuning_->refused(e.what());
    return;
  }
  do_it(tuning_->saved());
  if (!new_file) return;  // the sensor reads its own files again
  ask("keep");
  tuning_->note("saved; from the next start on: tagwrench run --profile " + tuning_->file());
}

/// What the sensor reads now. One that has forgotten us, for we were stopped or it was started
/// anew, is told again what to try.
void TuneSession::look() {
  const std::optional<std::string> answer = ask("live");
  const std::optional<LiveReading> reading =
      answer ? parse_live(*answer) : std::optional<LiveReading>();
  now_ = reading.value_or(LiveReading{});
  if (!answer || now_.on_trial) return;
  tuning_->note("");
  attempt();
}

/// Nothing: there is no sensor any more; another may come.
std::optional<std::string> TuneSession::ask(std::string_view wish) {
  try {
    if (!sensor_) sensor_.emplace(path_);
    return sensor_->ask(wish);
  } catch (const ConfigError& e) {
    sensor_.reset();
    tuning_->refused(std::string("the sensor has gone: ") + e.what());
    return {};
  }
}

}  // namespace

TuneCommand::TuneCommand(command_line::Command program)
    : verb_(program.add_subcommand("tune",
                                   "sliders for the profile of a sensor that runs, felt at once")) {
  verb_.add_option("profile", profile_,
                   "of those that the sensor has; without it the one in force");
  verb_.add_option("--name", name_, "of the sensor, as `tagwrench run --name` has it")
      .capture_default_str();
  verb_.add_option("--out", out_, "save to this new file, not where the profile is from");
}

int TuneCommand::run() const {
  TuneSession(control_path(name_), profile_, out_).run();
  return 0;
}

}  // namespace tagwrench
