#include "host/verbs/run_command.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cctype>
#include <cerrno>
#include <csignal>
#include <cstring>
#include <filesystem>
#include <memory>
#include <optional>
#include <utility>

#include "host/board/run_board.h"
#include "host/config/sensor_config.h"
#include "host/config_error.h"
#include "host/input.h"
#include "host/output/csv.h"
#include "host/output/gadget_output.h"
#include "host/output/joystick.h"
#include "host/output/jsonl.h"
#include "host/output/service_watch.h"
#include "host/output/spacemouse.h"
#include "host/output/spnav_output.h"
#include "host/output/terminal.h"
#include "host/output/wrench_hid.h"
#include "host/pipeline.h"
#include "host/source/region_source.h"
#include "host/tell.h"
#include "host/verbs/count_text.h"
#include "host/verbs/run_input.h"

namespace tagwrench {
namespace {

/// The outputs, and the devices among them that a guardian must bring to rest.
struct Outputs {
  std::vector<std::unique_ptr<Output>> all;
  std::vector<DeadManDevice> devices;
  const SpnavOutput* programs = nullptr;  ///< knows those that are connected
};

/// HID_UNIQ of both devices, and what clients show of them.
std::string serial_of(const std::string& sensor_name) { return "tagwrench-" + sensor_name; }

SpacemouseOptions spacemouse_options(const SensorConfig& sensor, const std::string& name) {
  SpacemouseOptions options;
  options.serial = serial_of(name);
  options.vendor = sensor.spacemouse.vendor;
  options.product = sensor.spacemouse.product;
  return options;
}

void add_device(Outputs& outputs, const std::string& kind, const SensorConfig& sensor,
                const std::string& name) {
  if (kind == "spacemouse") {
    auto device = std::make_unique<SpacemouseOutput>(spacemouse_options(sensor, name));
    device->add_to(outputs.devices);
    if (const std::string advice = device->spacenavd_advice(); !advice.empty()) tell(advice);
    outputs.all.push_back(std::move(device));
  } else if (kind == "wrench") {
    WrenchHidOptions options;
    options.serial = serial_of(name);
    auto device = std::make_unique<WrenchHidOutput>(options);
    device->add_to(outputs.devices);
    outputs.all.push_back(std::move(device));
  } else {
    JoystickOptions options;  // uinput has no serial number: the name tells two apart
    if (name != RunOptions().name) options.name += " " + name;
    auto device = std::make_unique<JoystickOutput>(options);
    device->add_to(outputs.devices);
    outputs.all.push_back(std::move(device));
  }
}

void add_gadget(Outputs& outputs, const std::string& face, const std::string& name) {
  GadgetOptions options;
  options.name = name;
  options.face = face_of(face);
  auto gadget = std::make_unique<GadgetOutput>(find_gadget(options));
  gadget->add_to(outputs.devices);
  outputs.all.push_back(std::move(gadget));
}

void add_spnav(Outputs& outputs, const std::string& socket, const SensorConfig& sensor) {
  SpnavOptions options;
  options.socket = socket;
  options.vendor = sensor.spacemouse.vendor;
  options.product = sensor.spacemouse.product;
  auto output = std::make_unique<SpnavOutput>(options);
  tell(output->advice());
  outputs.programs = output.get();
  outputs.all.push_back(std::move(output));
}

/// The program that connected last of those that are connected.
std::string_view last_program(const SpnavOutput& output) {
  if (output.programs().empty()) return {};
  return output.programs().back().name.data();
}

std::unique_ptr<Output> terminal(const Input& input, bool stdout_taken) {
  TerminalOptions options;
  options.fd = stdout_taken ? STDERR_FILENO : STDOUT_FILENO;
  const SensorConfig& sensor = input.sensor;
  options.full_scale = sensor.wrench.range.cwiseMin(sensor.shaping.full_scale * 1.5);
  options.source = input.source->format().description;
  return std::make_unique<TerminalOutput>(options);
}

/// What a user gets who asked for nothing: the view, and every device that this machine allows.
void add_default_outputs(Outputs& outputs, const Input& input, const std::string& name) {
  for (const char* kind : {"spacemouse", "wrench", "joystick"}) {
    try {
      add_device(outputs, kind, input.sensor, name);
    } catch (const ConfigError& e) {
      // Both uhid devices lack the same thing; say it once.
      if (kind != std::string("wrench"))
        tell(fmt::format("running without {}: {}", kind, e.what()));
    }
  }
  outputs.all.push_back(terminal(input, false));
}

bool is_device(const std::string& kind) {
  return kind == "spacemouse" || kind == "wrench" || kind == "joystick";
}

bool is_gadget(const Spec& spec) {
  return spec.kind == "gadget" && (spec.argument.empty() || face_of(spec.argument));
}

bool is_file(const std::string& kind) {
  return kind == "jsonl" || kind == "csv" || kind == "reference";
}

/// Refuses what cannot be, before anything is made or overwritten.
void check_outputs(const std::vector<Spec>& specs, bool with_board) {
  for (std::size_t i = 0; i < specs.size(); ++i) {
    const Spec& spec = specs[i];
    const bool known = spec.kind == "spnav" || is_gadget(spec) ||
                       (spec.argument.empty() ? spec.kind == "terminal" || is_device(spec.kind)
                                              : is_file(spec.kind));
    const std::string text = spec.argument.empty() ? spec.kind : spec.kind + ":" + spec.argument;
    if (!known) {
      throw ConfigError(fmt::format(
          "--output {}: not an output; use terminal, jsonl:FILE, csv:FILE, reference:FILE, "
          "spacemouse, wrench, joystick, spnav[:PATH] or gadget[:spacemouse|:wrench]",
          text));
    }
    if (spec.kind == "reference" && !with_board) {
      throw ConfigError(fmt::format(
          "--output {}: the load cells are a board's; name its port with --board", text));
    }
    for (std::size_t j = 0; j < i; ++j) {
      if (spec.argument.empty() ? specs[j].kind == spec.kind : specs[j].argument == spec.argument) {
        throw ConfigError(
            spec.argument == "-"
                ? "--output: only one output can go to standard output (-); give the others a file"
                : fmt::format("--output {}: is there twice; give every output a place of its own",
                              text));
      }
    }
    if (spec.argument.empty() || spec.argument == "-" || is_gadget(spec)) continue;
    const std::filesystem::path path = spec.argument;
    const std::filesystem::path folder = path.has_parent_path() ? path.parent_path() : ".";
    const bool exists = ::access(path.c_str(), F_OK) == 0;
    if (::access(exists ? path.c_str() : folder.c_str(), W_OK) != 0) {
      throw ConfigError(
          fmt::format("--output {}: cannot be written: {}; choose a file in a folder of yours",
                      text, std::strerror(errno)));
    }
  }
}

/// A board lives in real time.
void check_board(const RunOptions& options) {
  if (options.board.empty()) {
    if (!options.cells.empty())
      throw ConfigError("--cells: the load cells are a board's; name its port with --board");
    return;
  }
  if (options.fast)
    throw ConfigError("--fast: a board has its own time; leave it out, or leave out --board");
  const std::string kind = split_spec(options.source).kind;
  if (kind == "images" || kind == "recording") {
    throw ConfigError(fmt::format(
        "--source {}: these pictures are of another time than what the board says now; leave out "
        "--board",
        options.source));
  }
}

std::vector<Spec> output_specs(const RunOptions& options) {
  check_board(options);
  std::vector<Spec> specs;
  for (const std::string& text : options.outputs) specs.push_back(split_spec(text));
  check_outputs(specs, !options.board.empty());
  return specs;
}

/// Devices first, because they are what may be refused; files are only then overwritten. `board`
/// may be null.
Outputs open_outputs(const RunOptions& options, const Input& input, RunBoard* board) {
  Outputs outputs;
  if (options.outputs.empty()) {
    if (!options.record) add_default_outputs(outputs, input, options.name);
    if (board != nullptr) outputs.all.push_back(board->output(input.sensor, {}));
    return outputs;
  }
  const std::vector<Spec> specs = output_specs(options);
  for (const Spec& spec : specs) {
    if (is_device(spec.kind)) add_device(outputs, spec.kind, input.sensor, options.name);
    if (spec.kind == "gadget") add_gadget(outputs, spec.argument, options.name);
    if (spec.kind == "spnav") add_spnav(outputs, spec.argument, input.sensor);
  }
  // Only a source that waits for its reader may be made to wait.
  const bool lossless = options.fast && input.source->poll_fd() < 0;
  const bool stdout_taken = std::any_of(specs.begin(), specs.end(),
                                        [](const Spec& spec) { return spec.argument == "-"; });
  for (const Spec& spec : specs) {
    if (spec.kind == "terminal") outputs.all.push_back(terminal(input, stdout_taken));
    if (spec.kind == "jsonl")
      outputs.all.push_back(std::make_unique<JsonlOutput>(spec.argument, lossless));
    if (spec.kind == "csv")
      outputs.all.push_back(std::make_unique<CsvOutput>(spec.argument, lossless));
  }
  if (board != nullptr) {
    const auto reference = std::find_if(specs.begin(), specs.end(),
                                        [](const Spec& spec) { return spec.kind == "reference"; });
    outputs.all.push_back(
        board->output(input.sensor, reference == specs.end() ? "" : reference->argument));
  }
  return outputs;
}

bool is_input_device(const Spec& spec) {
  return spec.kind == "spacemouse" || spec.kind == "joystick" || spec.kind == "spnav" ||
         (spec.kind == "gadget" && spec.argument != "wrench");
}

/// Where wishes come in, for who has a device on his desk.
std::optional<ControlSocket> control_of(const RunOptions& options) {
  const std::vector<Spec> specs = output_specs(options);
  const bool device = (specs.empty() && !options.record) ||
                      std::any_of(specs.begin(), specs.end(), is_input_device);
  const bool on_hid = std::any_of(specs.begin(), specs.end(),
                                  [](const Spec& spec) { return is_device(spec.kind); });
  if (!device && !on_hid && options.profiles.empty()) return {};
  try {
    const std::string path = control_path(options.name);
    if (!on_hid || !listens(path)) return ControlSocket(path);
  } catch (const ConfigError& e) {
    tell(fmt::format("running without `tagwrench control`: {}", e.what()));
    return {};
  }
  // Two devices with one serial number would be mixed up by whoever opens them by it.
  throw ConfigError(fmt::format(
      "--name {}: a bridge of this name runs already; stop it, or give this one another name",
      options.name));
}

void check_name(const std::string& name) {
  const bool usable = !name.empty() && name.size() <= 32 &&
                      std::all_of(name.begin(), name.end(), [](unsigned char c) {
                        return std::isalnum(c) != 0 || c == '-' || c == '_';
                      });
  if (!usable)
    throw ConfigError(
        fmt::format("--name {}: must be 1 to 32 letters, digits, - and _; choose another", name));
}

/// What reads as nothing, as samples have it, and whether it may follow.
ZeroOptions zero_options(const SensorConfig& sensor, const Matrix6& tool, bool may_follow) {
  ZeroOptions options;
  options.follow = may_follow && sensor.zero.follow;
  options.range = range_through(tool, sensor.wrench.range);
  options.set = tool * sensor.zero.set;
  options.band = sensor.zero.band;
  options.rate = sensor.zero.rate;
  return options;
}

/// Says how far the zero went, if it is far enough to be seen.
void say_zero(const ZeroTracking& zero, const Vector6& range, double band) {
  constexpr double kSeen = 5e-4;  // of the range
  const Vector6& moved = zero.moved();
  double most = 0;
  for (int i = 0; i < 6; ++i) {
    if (range[i] > 0 && range[i] < kUnknownRange)
      most = std::max(most, std::abs(moved[i]) / range[i]);
  }
  if (most < kSeen) return;
  tell(fmt::format(
      "the zero followed what read while nobody touched: by {:.3g} {:.3g} {:.3g} N, {:.3g} {:.3g} "
      "{:.3g} mN m, {:.2g} % of the range{}",
      moved[0], moved[1], moved[2], moved[3] * 1e3, moved[4] * 1e3, moved[5] * 1e3, 100 * most,
      most > 0.9 * band ? ", about as far as it may: run `tagwrench zero`" : ""));
}

/// What is recorded of the run, told to all who have something to say. The guardian of the outputs
/// has been forked already: the recording has a thread.
Recording& start_recording(const RunOptions& options, const record::Head& head, const Input& input,
                           const RunLimits& limits, RunBoard* board, Outputs& outputs) {
  const bool lossless = options.fast && input.source->poll_fd() < 0;
  auto recording =
      std::make_unique<Recording>(*options.record, head, lossless, limits.frames, limits.time);
  Recording& started = *recording;
  outputs.all.push_back(std::move(recording));
  if (board != nullptr) board->record_to(started.writer());
  return started;
}

/// Ends it, and says so. False: something went wrong.
bool end_recording(std::unique_ptr<Output> output) {
  auto& recording = static_cast<Recording&>(*output);
  const std::string trouble = recording.finish();
  tell(recording.summary());
  if (!trouble.empty()) tell(trouble);
  return trouble.empty();
}

std::string summary(const RunReport& report, const SensorConfig& sensor) {
  const double seconds = std::chrono::duration<double>(report.elapsed).count();
  std::string line =
      fmt::format("{} in {:.2f} s ({:.1f} Hz), {} with numbers, {} dropped by the source",
                  count_text(static_cast<std::uint64_t>(report.frames), "frame"), seconds,
                  seconds > 0 ? report.frames / seconds : 0.0, report.with_numbers, report.dropped);
  if (report.skipped > 0)
    line += fmt::format(", {} samples not taken by slow readers", report.skipped);
  if (report.frames > 0 && report.with_numbers == 0) {
    line += "; the target was never held: ";
    if (!report.trouble.empty()) {
      line += report.trouble;
    } else if (report.frames <= static_cast<std::uint64_t>(std::max(0, sensor.rest.frames))) {
      line += fmt::format(
          "its rest pose is learned from the first {} frames (rest.frames); give it more",
          sensor.rest.frames);
    } else {
      line +=
          "are the tags in view, in focus and lit, and are family, ids and number of tags those of "
          "sensor.yaml?";
    }
  }
  return line;
}

}  // namespace

int run(const RunOptions& given) {
  std::signal(SIGPIPE, SIG_IGN);  // a closed pipe becomes an error code
  output_specs(given);            // refused before anything is opened or lit
  check_name(given.name);
  const RunOptions options = with_own_sensor(given);
  std::unique_ptr<ServiceWatch> watch = ServiceWatch::open();
  if (options.record) check_recording(*options.record);
  std::unique_ptr<RunBoard> board;
  if (!options.board.empty()) {
    BoardOptions board_options;
    board_options.port = options.board == "auto" ? "" : options.board;
    board_options.cells_file = options.cells;
    board = std::make_unique<RunBoard>(board_options);
    if (!board->connected()) return 0;
  }
  // Last of all what does not wait: a camera's frames, the simulated sensor's second at rest.
  std::optional<Input> found = open_run_input(options, watch.get());
  if (!found) return 0;
  Input input = std::move(*found);
  const UniqueFd stop = signals_as_fd();
  check_size(input);
  check_appearance(input);
  record::Head head;
  if (options.record) {
    head = recording_head(input, options.record->keep);
    if (head.keep == record::Keep::region)
      input.source = std::make_unique<RegionSource>(std::move(input.source));
  }
  if (board && !board->settle_light(input, stop)) return 0;
  Tracker tracker(input.sensor.camera, input.sensor.target, input.sensor.rest);
  WrenchEstimator wrench(input.sensor.wrench);
  const bool many_profiles = !options.profiles.empty();
  Desk desk(ProfileFiles(options.profiles, input.sensor), control_of(options),
            many_profiles ? FocusWatch::open() : std::nullopt);
  const ZeroOptions zero_limits =
      zero_options(input.sensor, wrench.tool(), !options.no_zero_tracking);
  ZeroTracking zero(zero_limits);
  Outputs outputs = open_outputs(options, input, board.get());
  if (many_profiles && outputs.programs != nullptr)
    desk.follow_programs([&programs = *outputs.programs] { return last_program(programs); });
  tell("source: " + input.source->format().description);
  if (watch != nullptr) {
    watch->ready("source: " + input.source->format().description);
    outputs.all.push_back(std::move(watch));
  }

  RunLimits limits;
  if (options.frames) limits.frames = static_cast<std::uint64_t>(*options.frames);
  if (options.seconds)
    limits.time =
        std::chrono::duration_cast<Duration>(std::chrono::duration<double>(*options.seconds));
  RunReport report;
  {
    DeadMan dead_man(outputs.devices);
    Recording* recording = nullptr;
    if (options.record)
      recording = &start_recording(options, head, input, limits, board.get(), outputs);
    Pipeline pipeline(*input.source, tracker, wrench, desk, outputs.all, dead_man, stop.get(),
                      recording);
    pipeline.follow_zero(zero);
    report = pipeline.run(limits);
  }
  std::unique_ptr<Output> recording;
  if (options.record) {
    recording = std::move(outputs.all.back());
    outputs.all.pop_back();
  }
  outputs.all.clear();  // neutral, then gone, before anything else is said
  const bool recorded = recording == nullptr || end_recording(std::move(recording));
  if (report.end == RunReport::End::output_failed) {
    if (recorded) tell(report.failure);
    return 1;
  }
  tell(summary(report, input.sensor));
  say_zero(zero, zero_limits.range, zero_limits.band);
  if (const std::string unusable = input.source->unusable(); !unusable.empty()) tell(unusable);
  return recorded ? 0 : 1;
}

}  // namespace tagwrench
