#include "host/web/bridge/jobs.h"

#include <fmt/format.h>
#include <sys/wait.h>

#include <cstring>
#include <exception>
#include <utility>

#include "host/web/bridge/job_process.h"

namespace tagwrench {
namespace {

constexpr std::chrono::milliseconds kTellEvery{100};
constexpr int kFindings = 1;  // exit status of a verb that found something amiss

/// It says what it found, good or bad: that is no failure of its own.
bool finds(const std::string& verb) { return verb == "check" || verb == "doctor"; }

nlohmann::json result_of(const std::string& verb) {
  if (verb != "certificate") return nullptr;
  return {{"html", "/files/certificate.html"},
          {"pdf", "/files/certificate.pdf"},
          {"json", "/files/certificate.json"}};
}

}  // namespace

Jobs::Jobs(boost::asio::io_context& context, std::string program, Hooks hooks)
    : context_(context),
      program_(std::move(program)),
      hooks_(std::move(hooks)),
      telling_(context) {}

Jobs::~Jobs() {
  if (process_) process_->abandon();
}

void Jobs::start(JobCommand command, bool camera_is_free) {
  if (running())
    throw RequestRefused(fmt::format("{} runs already; stop it first", report_->verb()));
  command_ = std::move(command);
  std::vector<std::string> keys{"stop"};
  if (command_.takes_keys) keys = {"skip", "redo", "stop"};
  report_.emplace(command_.verb, std::move(keys));
  if (!command_.needs_camera || camera_is_free) {
    spawn();
  } else {
    hooks_.want_camera();
  }
  hooks_.changed();
  log_soon();
}

void Jobs::camera_free() {
  if (holds_camera()) return spawn();
  hooks_.give_back_camera();  // stopped before it began
}

void Jobs::spawn() {
  const auto on_line = [this](auto take) {
    return [this, take](std::string_view text) {
      ((*report_).*take)(text);
      log_soon();
    };
  };
  JobProcess::Listener listener;
  listener.printed = on_line(&JobReport::printed);
  listener.said = on_line(&JobReport::said);
  listener.event = [this](std::string_view line) {
    if (const std::optional<JobPicture> picture = report_->event(line)) {
      hooks_.show(*picture);
    } else {
      log_soon();
    }
  };
  listener.ended = [this](int status) { ended(status); };
  try {
    process_ = JobProcess::start(context_, program_, command_, std::move(listener));
  } catch (const std::exception& e) {
    finish(JobReport::State::failed, e.what());
  }
}

void Jobs::ended(int status) {
  const bool stopped = process_->stopping();
  process_.reset();
  using State = JobReport::State;
  const bool well =
      WIFEXITED(status) &&
      (WEXITSTATUS(status) == 0 || (WEXITSTATUS(status) == kFindings && finds(command_.verb)));
  if (well) return finish(State::done, {}, result_of(command_.verb));
  if (stopped) return finish(State::stopped, {});
  if (WIFSIGNALED(status)) {
    return finish(State::failed, fmt::format("{} was ended from outside ({}); start it again",
                                             command_.verb, ::strsignal(WTERMSIG(status))));
  }
  finish(State::failed, {});
}

void Jobs::finish(JobReport::State state, std::string why, nlohmann::json result) {
  report_->ended(state, std::move(why), std::move(result));
  if (command_.needs_camera) hooks_.give_back_camera();
  hooks_.changed();
  log_soon();
}

void Jobs::press(const std::string& key) {
  if (!running()) throw RequestRefused("key: no job runs that could take it");
  if (key == "stop") {
    if (process_) return process_->stop();
    report_->ended(JobReport::State::stopped, {}, nullptr);  // it has not begun
    hooks_.changed();
    return log_soon();
  }
  const bool known = key == "skip" || key == "redo";
  if (!known || !command_.takes_keys || !process_)
    throw RequestRefused(fmt::format("key: {} takes {}", report_->verb(),
                                     command_.takes_keys ? "skip, redo and stop" : "stop alone"));
  process_->press(key == "skip" ? 's' : 'r');
}

void Jobs::close() {
  if (running()) throw RequestRefused(fmt::format("{} runs; stop it first", report_->verb()));
  report_.reset();
  hooks_.changed();
}

void Jobs::log_soon() {
  if (std::exchange(will_tell_, true)) return;
  telling_.after(kTellEvery, [this] {
    will_tell_ = false;
    if (report_) hooks_.tell(report_->to_json());
  });
}

}  // namespace tagwrench
