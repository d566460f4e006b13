#include "host/web/bridge/job_command.h"

#include <fmt/format.h>
#include <openssl/evp.h>

#include <array>
#include <cmath>
#include <filesystem>

#include "host/calibration/print/board_spec.h"
#include "host/calibration/wrench/plan.h"
#include "host/core/config_error.h"
#include "host/core/json/json_text.h"

namespace tagwrench {
namespace {

using nlohmann::json;

constexpr std::size_t kMaxText = 200;
constexpr double kMaxSeconds = 3600;
constexpr double kFarthest_mm = 1000;

enum class Needs : std::uint8_t { nothing, calibration, sensor };

struct JobVerb {
  std::string_view name;
  std::vector<std::string> words;
  Needs needs = Needs::sensor;
  bool camera = true;
  bool keys = false;
};

const std::array<JobVerb, 7>& job_verbs() {
  static const std::array<JobVerb, 7> verbs = {{
      {"camera", {"calibrate", "camera"}},
      {"target", {"calibrate", "target"}},
      {"wrench", {"calibrate", "wrench"}, Needs::sensor, true, true},
      {"check", {"check"}},
      {"zero", {"zero"}},
      {"certificate", {"certificate"}, Needs::calibration, false},
      {"doctor", {"doctor"}, Needs::nothing, false},
  }};
  return verbs;
}

const JobVerb& verb_named(std::string_view name) {
  const auto found = std::find_if(job_verbs().begin(), job_verbs().end(),
                                  [&](const JobVerb& v) { return v.name == name; });
  if (found != job_verbs().end()) return *found;
  throw RequestRefused(
      "verb: is none of camera, target, wrench, check, zero, certificate and doctor; reload the "
      "page");
}

/// Why it cannot be, whatever the options; empty if it can.
std::string objection_to(const JobVerb& verb, const JobPlace& place) {
  const SourceKind kind = place.source_kind;
  if (verb.needs != Needs::nothing && place.sensor.empty()) {
    return fmt::format(
        "{}: this sensor has no sensor.yaml to write to; start with `tagwrench run --sensor FILE`",
        verb.name);
  }
  if (verb.needs == Needs::calibration && !place.calibrated)
    return fmt::format("{}: the sensor is not calibrated in newtons; do that first", verb.name);
  if (verb.camera && place.kept) {
    return fmt::format(
        "{}: needs the camera, but what this run records or compares would end; start without them",
        verb.name);
  }
  if (verb.name == "camera" && kind != SourceKind::camera && kind != SourceKind::images)
    return "camera: needs a real camera; start with `tagwrench run --source v4l2:/dev/videoN`";
  if (verb.camera && kind == SourceKind::recording)
    return fmt::format("{}: needs a live sensor, and this is a recording of one", verb.name);
  if (verb.name == "wrench" && kind == SourceKind::images)
    return "wrench: nobody is in the pictures who could hang a weight; use a camera or sim";
  return {};
}

/// Options of a request, each looked at once; what was not asked for is refused.
class JobOptions {
 public:
  explicit JobOptions(const json& options) : options_(options) {
    if (!options.is_null() && !options.is_object())
      throw RequestRefused("options: must be an object; reload the page");
  }

  const json* find(const char* key) {
    taken_.emplace_back(key);
    if (!options_.is_object()) return nullptr;
    const auto found = options_.find(key);
    return found == options_.end() || found->is_null() ? nullptr : &*found;
  }
  std::string text(const char* key) {
    const json* value = find(key);
    if (value == nullptr) return {};
    const bool usable =
        value->is_string() && value->get_ref<const std::string&>().size() <= kMaxText;
    if (!usable)
      throw RequestRefused(fmt::format("{}: must be a text of at most {} bytes", key, kMaxText));
    return checked_line(key, value->get<std::string>());
  }
  bool flag(const char* key) {
    const json* value = find(key);
    if (value != nullptr && !value->is_boolean())
      throw RequestRefused(fmt::format("{}: must be true or false", key));
    return value != nullptr && value->get<bool>();
  }
  /// Refuses what nobody asked for.
  void done() const {
    if (!options_.is_object()) return;
    for (const auto& [key, value] : options_.items())
      if (std::find(taken_.begin(), taken_.end(), key) == taken_.end())
        throw RequestRefused("options: has a key that this job does not know; reload the page");
  }

 private:
  const json& options_;
  std::vector<std::string> taken_;
};

void add_camera(JobOptions& options, std::vector<std::string>& arguments) {
  const std::string board = options.text("board");
  try {
    parse_board(board);
  } catch (const ConfigError& e) {
    throw RequestRefused(e.what());
  }
  arguments.push_back("--board=" + board);
}

void add_target(JobOptions& options, std::vector<std::string>& arguments) {
  if (const json* seconds = options.find("seconds")) {
    arguments.push_back(
        fmt::format("--seconds={:g}", checked_number("seconds", *seconds, 1, kMaxSeconds)));
  }
}

void add_wrench(JobOptions& options, const JobPlace& place, std::vector<std::string>& arguments) {
  const std::string plan = options.text("plan");
  const std::vector<ReadyPlan>& plans = ready_plans();
  const auto ready =
      std::find_if(plans.begin(), plans.end(), [&](const ReadyPlan& p) { return p.name == plan; });
  if (ready == plans.end()) {
    std::string names;
    for (const ReadyPlan& p : plans) names += (names.empty() ? "" : ", ") + p.name;
    throw RequestRefused("plan: must be one of " + names);
  }
  const ReferenceKind reference = parse_plan(ready->text, ready->name).reference;
  if (reference == ReferenceKind::six_axis && place.source_kind != SourceKind::simulator) {
    throw RequestRefused(
        fmt::format("plan {}: needs the port of the six-axis sensor; run `tagwrench calibrate "
                    "wrench` in a terminal",
                    plan));
  }
  if (reference == ReferenceKind::load_cell && place.source_kind != SourceKind::simulator) {
    if (place.board.empty()) {
      throw RequestRefused(
          fmt::format("plan {}: needs a load cell; start with `tagwrench run --board PORT`", plan));
    }
    arguments.push_back("--board=" + place.board);
    if (!place.cells.empty()) arguments.push_back("--cells=" + place.cells);
  }
  arguments.push_back("--plan=" + plan);
  if (const std::string notes = options.text("notes"); !notes.empty())
    arguments.push_back("--notes=" + notes);
  const bool resume = options.flag("resume");
  const bool force = options.flag("force");
  if (resume && force) throw RequestRefused("resume, force: choose one of the two");
  if (resume) arguments.emplace_back("--resume");
  if (force) arguments.emplace_back("--force");
}

void add_check(JobOptions& options, std::vector<std::string>& arguments) {
  const json* mass = options.find("mass_g");
  const json* at = options.find("at");
  if (mass == nullptr && at == nullptr) return;
  if (mass == nullptr || at == nullptr || !at->is_array() || at->size() != 3)
    throw RequestRefused("mass_g, at: give both, the place as three numbers in mm");
  arguments.push_back(fmt::format("--mass-g={:g}", checked_number("mass_g", *mass, 0.1, 1e5)));
  std::string place;
  for (const json& mm : *at) {
    place += fmt::format("{}{:g}", place.empty() ? "" : ",",
                         checked_number("at", mm, -kFarthest_mm, kFarthest_mm));
  }
  arguments.push_back("--at=" + place);
}

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

}  // namespace

std::string checked_line(const char* key, std::string text) {
  if (std::ranges::none_of(text, [](unsigned char c) { return c < 0x20 || c == 0x7f; }))
    return text;
  throw RequestRefused(fmt::format("{}: must be one line of plain text", key));
}

double checked_number(const char* key, const json& value, double least, double most) {
  const double number = value.is_number() ? value.get<double>() : std::nan("");
  if (number >= least && number <= most) return number;
  throw RequestRefused(fmt::format("{}: must be a number from {:g} to {:g}", key, least, most));
}

JobCommand job_command(std::string_view verb, const json& wished, const JobPlace& place) {
  const JobVerb& of = verb_named(verb);
  if (const std::string why = objection_to(of, place); !why.empty()) throw RequestRefused(why);
  JobCommand command{std::string(verb), of.words, of.camera, of.keys, of.camera};
  JobOptions options(wished);
  if (of.needs != Needs::nothing) command.arguments.push_back("--sensor=" + place.sensor);
  if (of.camera) command.arguments.push_back("--source=" + place.source);
  if (verb == "camera") add_camera(options, command.arguments);
  if (verb == "target") add_target(options, command.arguments);
  if (verb == "wrench") add_wrench(options, place, command.arguments);
  if (verb == "check") add_check(options, command.arguments);
  if (verb == "certificate") {
    command.arguments.push_back("--out=" + certificate_folder(place) + "/certificate.html");
    command.arguments.emplace_back("--force");
  }
  options.done();
  return command;
}

std::vector<std::string> possible_jobs(const JobPlace& place) {
  std::vector<std::string> names;
  for (const JobVerb& verb : job_verbs())
    if (objection_to(verb, place).empty()) names.emplace_back(verb.name);
  return names;
}

std::string certificate_folder(const JobPlace& place) {
  const std::filesystem::path folder = std::filesystem::path(place.sensor).parent_path();
  return folder.empty() ? "." : folder.string();
}

void JobReport::said(std::string_view line) {
  constexpr std::string_view kProgram = "tagwrench: ";
  constexpr std::string_view kTask = "> ";
  if (line.starts_with(kProgram)) line.remove_prefix(kProgram.size());
  const bool task = line.starts_with(kTask);
  if (task) line.remove_prefix(kTask.size());
  if (!line.empty()) add(task ? "task" : "note", std::string(line.substr(0, kMaxLine)));
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

}  // namespace tagwrench
