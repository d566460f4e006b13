#include "host/web/bridge/jobs.h"

#include <fmt/format.h>
#include <openssl/evp.h>
#include <sys/wait.h>

#include <algorithm>
#include <cstring>
#include <exception>
#include <utility>

#include "host/core/json/json_text.h"
#include "host/web/bridge/job_process.h"

namespace tagwrench {
namespace {

using nlohmann::json;

constexpr int kMaxPicture_px = 16'384;

constexpr std::string_view kDigits =
    "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";

const char* state_name(JobReport::State state) {
  switch (state) {
    case JobReport::State::running: return "running";
    case JobReport::State::done: return "done";
    case JobReport::State::failed: return "failed";
    case JobReport::State::stopped: return "stopped";
  }
  return "?";
}

/// The member of this name, if it is of this type.
const json* member(const json& object, const char* key, json::value_t type) {
  const auto found = object.find(key);
  return found == object.end() || found->type() != type ? nullptr : &*found;
}

int size_of(const json& picture, const char* key) {
  const auto found = picture.find(key);
  if (found == picture.end() || !found->is_number_integer()) return 0;
  const auto size = found->get<std::int64_t>();
  return size > 0 && size <= kMaxPicture_px ? static_cast<int>(size) : 0;
}

std::optional<JobPicture> picture_in(const json& event) {
  const json* jpeg = member(event, "jpeg", json::value_t::string);
  const json* tags = member(event, "tags", json::value_t::array);
  if (jpeg == nullptr || tags == nullptr) return {};
  std::optional<std::vector<std::uint8_t>> bytes = from_base64(jpeg->get_ref<const std::string&>());
  JobPicture picture{size_of(event, "width"), size_of(event, "height"), *tags, {}};
  if (!bytes || picture.width == 0 || picture.height == 0) return {};
  picture.jpeg = std::move(*bytes);
  return picture;
}

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

JobReport::JobReport(std::string verb, std::vector<std::string> keys)
    : verb_(std::move(verb)), keys_(std::move(keys)) {}

void JobReport::said(std::string_view line) {
  constexpr std::string_view kProgram = "tagwrench: ";
  constexpr std::string_view kTask = "> ";
  if (line.starts_with(kProgram)) line.remove_prefix(kProgram.size());
  const bool task = line.starts_with(kTask);
  if (task) line.remove_prefix(kTask.size());
  if (!line.empty()) add(task ? "task" : "note", std::string(line.substr(0, kMaxLine)));
}

void JobReport::printed(std::string_view text) {
  printed_ += text.substr(0, kMaxText - std::min(kMaxText, printed_.size()));
}

std::optional<JobPicture> JobReport::event(std::string_view text) {
  const json event = parse_json(text);
  if (!event.is_object()) return {};
  if (const json* line = member(event, "line", json::value_t::object)) {
    const json* kind = member(*line, "kind", json::value_t::string);
    const json* words = member(*line, "text", json::value_t::string);
    if (kind != nullptr && words != nullptr)
      add(kind->get<std::string>(), words->get<std::string>().substr(0, kMaxLine));
  }
  if (const json* live = member(event, "live", json::value_t::string))
    live_ = live->get<std::string>();
  if (const json* coverage = member(event, "coverage", json::value_t::object))
    coverage_ = *coverage;
  const auto progress = event.find("progress");
  if (progress != event.end() && progress->is_number()) progress_ = *progress;
  const json* picture = member(event, "picture", json::value_t::object);
  return picture == nullptr ? std::nullopt : picture_in(*picture);
}

void JobReport::ended(State state, std::string why, json result) {
  state_ = state;
  live_.clear();
  keys_.clear();
  if (state == State::done) progress_ = 1.0;
  // Its last words say why it failed, what it printed is what it found.
  if (state == State::failed && !lines_.empty() && lines_.back().kind == "note")
    lines_.back().kind = "warning";
  if (!why.empty()) add(state == State::failed ? "warning" : "result", std::move(why));
  result_ = std::move(result);
  if (!printed_.empty()) {
    if (!result_.is_object()) result_ = json::object();
    result_["text"] = printed_;
  }
}

json JobReport::to_json() const {
  nlohmann::json lines = nlohmann::json::array();
  for (const Line& line : lines_) lines.push_back({{"kind", line.kind}, {"text", line.text}});
  return {{"verb", verb_},
          {"state", state_name(state_)},
          {"lines", std::move(lines)},
          {"live", live_},
          {"coverage", coverage_},
          {"progress", progress_},
          {"keys", keys_},
          {"result", result_}};
}

void JobReport::add(std::string kind, std::string text) {
  lines_.push_back({std::move(kind), std::move(text)});
  if (lines_.size() > kMaxLines) lines_.pop_front();
}

std::optional<std::vector<std::uint8_t>> from_base64(std::string_view text) {
  std::string_view digits = text;
  while (digits.size() + 2 > text.size() && digits.ends_with('=')) digits.remove_suffix(1);
  // libcrypto takes padding and white space for digits.
  if (text.size() % 4 != 0 || digits.find_first_not_of(kDigits) != std::string_view::npos)
    return {};
  std::vector<std::uint8_t> bytes(text.size() / 4 * 3);
  EVP_DecodeBlock(bytes.data(), reinterpret_cast<const unsigned char*>(text.data()),
                  static_cast<int>(text.size()));
  bytes.resize(bytes.size() - (text.size() - digits.size()));
  return bytes;
}

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
  if (!command_.needs_camera || camera_is_free)
    spawn();
  else
    hooks_.want_camera();
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
    if (const std::optional<JobPicture> picture = report_->event(line))
      hooks_.show(*picture);
    else
      log_soon();
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
