#include "host/run_command.h"

#include <fmt/format.h>
#include <poll.h>
#include <sys/signalfd.h>
#include <unistd.h>

#include <csignal>
#include <filesystem>
#include <functional>
#include <memory>

#include "host/config/scenario_config.h"
#include "host/config/sensor_config.h"
#include "host/config_error.h"
#include "host/os/unique_fd.h"
#include "host/output/csv.h"
#include "host/output/joystick.h"
#include "host/output/jsonl.h"
#include "host/output/spacemouse.h"
#include "host/output/terminal.h"
#include "host/output/wrench_hid.h"
#include "host/pipeline.h"
#include "host/source/images.h"
#include "host/source/simulator/folder_export.h"
#include "host/source/simulator/simulator_source.h"
#include "host/source/v4l2_nodes.h"
#include "host/source/v4l2_source.h"

namespace tagwrench {
namespace {

struct Spec {
  std::string kind;
  std::string argument;
};

/// "kind:argument", or "kind".
Spec split(const std::string& spec) {
  const std::size_t colon = spec.find(':');
  if (colon == std::string::npos) return {spec, ""};
  return {spec.substr(0, colon), spec.substr(colon + 1)};
}

void note(const std::string& line) { fmt::print(stderr, "tagwrench: {}\n", line); }

/// A source and the sensor that it shows.
struct Input {
  SensorConfig sensor;
  std::unique_ptr<FrameSource> source;
};

SensorConfig sensor_or(const RunOptions& options, const std::function<SensorConfig()>& fallback) {
  return options.sensor.empty() ? fallback() : load_sensor(options.sensor);
}

/// The paper's sensor with nominal lens: what a fresh build comes closest to.
SensorConfig paper_sensor() {
  return parse_sensor(sim::sensor_yaml(sim::Scenario{}), "the built-in sensor");
}

Input open_simulator(const RunOptions& options, const std::string& scenario_file) {
  const sim::Scenario scenario =
      scenario_file.empty() ? sim::Scenario{} : load_scenario(scenario_file);
  Input input;
  input.sensor = sensor_or(
      options, [&] { return parse_sensor(sim::sensor_yaml(scenario), "the simulated sensor"); });
  input.source = std::make_unique<SimulatorSource>(scenario, !options.fast);
  return input;
}

Input open_images(const RunOptions& options, const std::string& folder) {
  const std::filesystem::path beside = std::filesystem::path(folder) / "sensor.yaml";
  Input input;
  input.sensor = sensor_or(options, [&] {
    return std::filesystem::exists(beside) ? load_sensor(beside) : paper_sensor();
  });
  input.source = std::make_unique<ImagesSource>(folder, options.fast);
  return input;
}

Input open_camera(const RunOptions& options, const std::string& argument) {
  Input input;
  input.sensor = sensor_or(options, paper_sensor);
  V4l2Options camera = parse_v4l2_spec(argument);
  camera.preferred_width = input.sensor.camera.width_px;
  camera.preferred_height = input.sensor.camera.height_px;
  input.source = std::make_unique<V4l2Source>(camera);
  return input;
}

/// Whether the source shows the sensor's tags within `patience`.
bool sees_tags(Input& input, Duration patience) {
  Tracker tracker(input.sensor.camera, input.sensor.target, input.sensor.rest);
  const TimePoint until = std::chrono::steady_clock::now() + patience;
  for (TimePoint now; (now = std::chrono::steady_clock::now()) < until;) {
    pollfd fd{input.source->poll_fd(), POLLIN, 0};
    const auto left = std::chrono::duration_cast<std::chrono::milliseconds>(until - now);
    if (::poll(&fd, 1, static_cast<int>(left.count()) + 1) <= 0) continue;
    Frame frame;
    if (input.source->read(frame) != ReadStatus::frame) continue;
    const Track track = tracker.track(frame);
    if (track.tags_held > 0 || track.hint == Hint::image_looks_mirrored) return true;
  }
  return false;
}

/// The first camera that sees the tags; the simulated sensor where there is none.
Input find_input(const RunOptions& options) {
  constexpr Duration kPatience = std::chrono::seconds(2);
  int cameras = 0;
  for (const CameraNode& node : list_camera_nodes()) {
    if (!node.captures) continue;
    try {
      Input input = open_camera(options, node.path);
      ++cameras;
      if (input.source->format().width == input.sensor.camera.width_px &&
          sees_tags(input, kPatience))
        return input;
    } catch (const ConfigError& e) {
      note(e.what());
    }
  }
  note(cameras == 0 ? "no camera found: showing the simulated sensor (--source v4l2:/dev/videoN "
                      "picks a camera)"
                    : "no camera sees the tags: showing the simulated sensor (--source "
                      "v4l2:/dev/videoN insists)");
  RunOptions simulated = options;
  simulated.sensor.clear();  // it describes the camera that is not there
  return open_simulator(simulated, "");
}

Input open_input(const RunOptions& options) {
  if (options.source.empty()) return find_input(options);
  const Spec spec = split(options.source);
  if (spec.kind == "sim") return open_simulator(options, spec.argument);
  if (spec.kind == "images" && !spec.argument.empty()) return open_images(options, spec.argument);
  if (spec.kind == "v4l2" && !spec.argument.empty()) return open_camera(options, spec.argument);
  if (spec.kind == "recording") {
    throw ConfigError("--source recording: this version reads no recordings yet; use images:DIR");
  }
  throw ConfigError(fmt::format(
      "--source {}: not a source; use sim, sim:SCENARIO.yaml, v4l2:/dev/videoN or images:DIR",
      options.source));
}

void check_size(const Input& input) {
  const SourceFormat& format = input.source->format();
  const CameraModel& camera = input.sensor.camera;
  if (format.width == camera.width_px && format.height == camera.height_px) return;
  throw ConfigError(fmt::format(
      "{}: frames are {}x{}, but sensor.yaml's camera is {}x{}; give the --sensor made for this "
      "mode, or ask the camera for that size",
      format.description, format.width, format.height, camera.width_px, camera.height_px));
}

/// The outputs, and the devices among them that a guardian must bring to rest.
struct Outputs {
  std::vector<std::unique_ptr<Output>> all;
  std::vector<DeadManDevice> devices;
};

SpacemouseOptions spacemouse_options(const SensorConfig& sensor) {
  SpacemouseOptions options;
  options.vendor = sensor.spacemouse.vendor;
  options.product = sensor.spacemouse.product;
  return options;
}

void add_device(Outputs& outputs, const std::string& kind, const SensorConfig& sensor) {
  if (kind == "spacemouse") {
    auto device = std::make_unique<SpacemouseOutput>(spacemouse_options(sensor));
    device->add_to(outputs.devices);
    if (const std::string advice = device->spacenavd_advice(); !advice.empty()) note(advice);
    outputs.all.push_back(std::move(device));
  } else if (kind == "wrench") {
    auto device = std::make_unique<WrenchHidOutput>(WrenchHidOptions{});
    device->add_to(outputs.devices);
    outputs.all.push_back(std::move(device));
  } else {
    auto device = std::make_unique<JoystickOutput>(JoystickOptions{});
    device->add_to(outputs.devices);
    outputs.all.push_back(std::move(device));
  }
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
void add_default_outputs(Outputs& outputs, const Input& input) {
  for (const char* kind : {"spacemouse", "wrench", "joystick"}) {
    try {
      add_device(outputs, kind, input.sensor);
    } catch (const ConfigError& e) {
      // Both uhid devices lack the same thing; say it once.
      if (kind != std::string("wrench"))
        note(fmt::format("running without {}: {}", kind, e.what()));
    }
  }
  outputs.all.push_back(terminal(input, false));
}

Outputs open_outputs(const RunOptions& options, const Input& input) {
  Outputs outputs;
  if (options.outputs.empty()) {
    add_default_outputs(outputs, input);
    return outputs;
  }
  int to_stdout = 0;
  for (const std::string& text : options.outputs) to_stdout += split(text).argument == "-" ? 1 : 0;
  if (to_stdout > 1)
    throw ConfigError(
        "--output: only one output can go to standard output (-); give the others a file");
  for (const std::string& text : options.outputs) {
    const Spec spec = split(text);
    const bool file = !spec.argument.empty();
    if (spec.kind == "terminal" && !file) {
      outputs.all.push_back(terminal(input, to_stdout > 0));
    } else if (spec.kind == "jsonl" && file) {
      outputs.all.push_back(std::make_unique<JsonlOutput>(spec.argument, options.fast));
    } else if (spec.kind == "csv" && file) {
      outputs.all.push_back(std::make_unique<CsvOutput>(spec.argument, options.fast));
    } else if ((spec.kind == "spacemouse" || spec.kind == "wrench" || spec.kind == "joystick") &&
               !file) {
      add_device(outputs, spec.kind, input.sensor);
    } else {
      throw ConfigError(
          fmt::format("--output {}: not an output; use terminal, jsonl:FILE, csv:FILE, spacemouse, "
                      "wrench or joystick",
                      text));
    }
  }
  return outputs;
}

/// Ctrl-C, kill and a closed terminal become readable instead of interrupting; a closed pipe
/// becomes an error code.
UniqueFd signals_as_fd() {
  std::signal(SIGPIPE, SIG_IGN);
  sigset_t signals;
  sigemptyset(&signals);
  for (int signal : {SIGINT, SIGTERM, SIGHUP}) sigaddset(&signals, signal);
  sigprocmask(SIG_BLOCK, &signals, nullptr);
  return UniqueFd(::signalfd(-1, &signals, SFD_CLOEXEC | SFD_NONBLOCK));
}

std::string summary(const RunReport& report) {
  const double seconds = std::chrono::duration<double>(report.elapsed).count();
  std::string line = fmt::format(
      "{} frames in {:.2f} s ({:.1f} Hz), {} with numbers, {} dropped by the source", report.frames,
      seconds, seconds > 0 ? report.frames / seconds : 0.0, report.with_numbers, report.dropped);
  if (report.skipped > 0)
    line += fmt::format(", {} samples not taken by slow readers", report.skipped);
  return line;
}

}  // namespace

int run(const RunOptions& options) {
  const UniqueFd stop = signals_as_fd();
  Input input = open_input(options);
  check_size(input);
  Tracker tracker(input.sensor.camera, input.sensor.target, input.sensor.rest);
  const WrenchEstimator wrench(input.sensor.wrench);
  const Shaping shaping(input.sensor.shaping);
  Outputs outputs = open_outputs(options, input);
  note("source: " + input.source->format().description);

  RunLimits limits;
  if (options.frames) limits.frames = static_cast<std::uint64_t>(*options.frames);
  if (options.seconds)
    limits.time =
        std::chrono::duration_cast<Duration>(std::chrono::duration<double>(*options.seconds));
  RunReport report;
  {
    DeadMan dead_man(outputs.devices);
    report = Pipeline(*input.source, tracker, wrench, shaping, outputs.all, dead_man, stop.get())
                 .run(limits);
  }
  outputs.all.clear();  // neutral, then gone, before anything else is said
  if (report.end == RunReport::End::output_failed) {
    note(report.failure);
    return 1;
  }
  note(summary(report));
  return 0;
}

}  // namespace tagwrench
