#include "host/web/bridge/job_command.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "host/calibration/print/board_spec.h"
#include "host/calibration/wrench/plan.h"
#include "host/core/config_error.h"

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

}  // namespace tagwrench
