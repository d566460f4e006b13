#include "host/app/input.h"

#include <fmt/format.h>
#include <poll.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <utility>

#include "host/app/recording.h"
#include "host/app/scenario_config.h"
#include "host/core/config_error.h"
#include "host/core/log.h"
#include "host/core/os/termination.h"
#include "host/recording/reader.h"
#include "host/source/replay.h"
#include "host/source/simulator/simulator_source.h"
#include "host/source/v4l2_source.h"
#include "host/tracker/reference.h"

namespace tagwrench {
namespace {

/// The sensor that was asked for.
bool given_sensor(const InputOptions& options, Input& input) {
  if (options.sensor.empty()) return false;
  input.sensor_name = options.sensor;
  input.sensor = load_sensor(options.sensor, options.calibration);
  return true;
}

/// One that has no file.
void built_in_sensor(std::string text, const char* name, Input& input) {
  input.sensor = parse_sensor(text, name);
  input.sensor_name = name;
  input.sensor_text = std::move(text);
}

void paper_sensor(Input& input) {
  built_in_sensor(paper_sensor_yaml(), "the built-in sensor", input);
}

sim::Scenario scenario_of(const std::string& file) {
  return file.empty() ? sim::Scenario{} : load_scenario(file);
}

/// Loaded by the bench where there is one, else as the scenario says.
Input simulated(const InputOptions& options, const sim::Scenario& scenario, sim::Bench* bench) {
  Input input;
  if (!given_sensor(options, input))
    built_in_sensor(sim::sensor_yaml(scenario), "the simulated sensor", input);
  input.source = std::make_unique<SimulatorSource>(scenario, !options.fast, nullptr, bench);
  return input;
}

Input open_simulator(const InputOptions& options, const std::string& scenario_file) {
  return simulated(options, scenario_of(scenario_file), nullptr);
}

Input open_images(const InputOptions& options, const std::string& folder) {
  const std::filesystem::path beside = std::filesystem::path(folder) / "sensor.yaml";
  Input input;
  std::error_code unreadable;  // the source itself will complain
  if (!given_sensor(options, input)) {
    if (std::filesystem::exists(beside, unreadable)) {
      input.sensor_name = beside;
      input.sensor = load_sensor(beside, options.calibration);
    } else {
      paper_sensor(input);
    }
  }
  input.source = std::make_unique<ImagesSource>(folder, options.fast);
  return input;
}

Input open_recording(const InputOptions& options, const std::string& file) {
  auto recording = std::make_unique<record::RecordingReader>(file, options.if_damaged);
  Input input;
  if (!given_sensor(options, input)) {
    input.recorded = recording->head();
    input.sensor = recorded_sensor(recording->head(), file, options.calibration);
  }
  input.source = std::make_unique<RecordingSource>(std::move(recording), options.fast);
  return input;
}

Input open_camera(const InputOptions& options, const std::string& argument) {
  Input input;
  if (!given_sensor(options, input)) paper_sensor(input);
  V4l2Options camera = parse_v4l2_spec(argument);
  camera.preferred_width = input.sensor.camera.width_px;
  camera.preferred_height = input.sensor.camera.height_px;
  const UniqueFd caught = termination_fd();  // from here on the camera's settings must be put back
  input.source = std::make_unique<V4l2Source>(camera);
  return input;
}

constexpr std::array<SourceRow, 4> kRows = {{
    {.kind = SourceKind::simulator,
     .name = "sim",
     .argument = "SCENARIO.yaml",
     .stands_alone = true,
     .help = "the simulated sensor",
     .open = open_simulator},
    {.kind = SourceKind::camera,
     .name = "v4l2",
     .argument = "/dev/videoN[,WxH[@FPS][,FOURCC]]",
     .open = open_camera},
    {.kind = SourceKind::images,
     .name = "images",
     .argument = "DIR",
     .help = "PNG, PGM or JPEG in name order, times from DIR/frames.csv",
     .own_time = true,
     .open = open_images},
    {.kind = SourceKind::recording,
     .name = "recording",
     .argument = "FILE",
     .help = "what `tagwrench record` made",
     .own_time = true,
     .open = open_recording},
}};

/// "sim, sim:SCENARIO.yaml", "images:DIR"
std::string forms(const SourceRow& row, const char* separator) {
  const std::string with_argument = fmt::format("{}:{}", row.name, row.argument);
  return row.stands_alone ? row.name + (separator + with_argument) : with_argument;
}

std::string all_forms() {
  std::string text;
  for (const SourceRow& row : kRows) {
    if (!text.empty()) text += &row == &kRows.back() ? " or " : ", ";
    text += forms(row, ", ");
  }
  return text;
}

}  // namespace

Spec split_spec(const std::string& spec) {
  const std::size_t colon = spec.find(':');
  if (colon == std::string::npos) return {spec, ""};
  return {spec.substr(0, colon), spec.substr(colon + 1)};
}

std::string paper_sensor_yaml() { return sim::sensor_yaml(sim::Scenario{}); }

std::string paper_sensor_yaml(const CameraModel& camera) {
  sim::Scenario scenario;
  sim::Camera& to = scenario.camera;
  to.width_px = camera.width_px;
  to.height_px = camera.height_px;
  to.fx_px = camera.fx_px;
  to.fy_px = camera.fy_px;
  to.cx_px = camera.cx_px;
  to.cy_px = camera.cy_px;
  std::copy(camera.distortion.begin(), camera.distortion.end(), to.distortion.begin());
  to.mirrored = camera.mirrored;
  const std::string text = sim::sensor_yaml(scenario);
  return "# The camera as it was found; target and springs are the paper's: change what "
         "differs.\n" +
         text.substr(text.find('\n') + 1);
}

Input open_input(const InputOptions& options) {
  const SourceSpec spec = parse_source(options.source);
  Input input = spec.row->open(options, spec.argument);
  input.kind = spec.row->kind;
  input.argument = spec.argument;
  input.spec = options.source;
  return input;
}

void check_size(const Input& input) {
  const SourceFormat& format = input.source->format();
  const CameraModel& camera = input.sensor.camera;
  if (format.width == camera.width_px && format.height == camera.height_px) return;
  throw ConfigError(
      "{}: frames are {}x{}, but sensor.yaml's camera is {}x{}; give the --sensor made for this "
      "mode, or ask the camera for that size",
      format.description, format.width, format.height, camera.width_px, camera.height_px);
}

void check_whole(const FrameSource& source, record::IfDamaged if_damaged) {
  if (if_damaged == record::IfDamaged::refuse && source.damaged())
    throw DamagedFile("{}; take a copy that is whole; nothing was written", source.unusable());
}

void check_appearance(const Input& input) {
  const SensorConfig& sensor = input.sensor;
  const auto mismatch = check_appearance(sensor.camera, sensor.target, sensor.rest);
  if (!mismatch) return;
  if (mismatch->seen_id)
    throw ConfigError(
        "{}: the picture at rest shows tag {} of {} where the rest pose puts tag {}; correct "
        "target.tags and run `tagwrench calibrate target`, or put tag {} in its place",
        sensor.target_from.file, *mismatch->seen_id, name(sensor.target.family), mismatch->id,
        mismatch->id);
  throw ConfigError(
      "{}: the picture at rest does not show tag {} of {} where the rest pose puts it (likeness "
      "{:.2f}); run `tagwrench calibrate target`, or remove {}",
      sensor.target_from.file, mismatch->id, name(sensor.target.family), mismatch->likeness,
      sensor.target_from.file == InForce{}.file ? "rest.appearance" : "the file");
}

Tracker make_tracker(const SensorConfig& sensor) {
  return Tracker(sensor.camera, sensor.target, sensor.rest);
}

Next next_frame(FrameSource& source, const UniqueFd& stop, Frame& frame) {
  constexpr int kPatience_ms = 200;
  pollfd fds[2] = {{source.poll_fd(), POLLIN, 0}, {stop.get(), POLLIN, 0}};
  ::poll(fds, 2, source.poll_fd() < 0 ? 0 : kPatience_ms);
  if (fds[1].revents != 0) return Next::stopped;
  const ReadStatus status = source.read(frame);
  if (status == ReadStatus::end) return Next::end;
  if (status == ReadStatus::disconnected || status == ReadStatus::reconnected)
    log_info(source.detail());
  return status == ReadStatus::frame ? Next::frame : Next::nothing;
}

std::span<const SourceRow> source_rows() { return kRows; }

SourceSpec parse_source(const std::string& text) {
  const Spec spec = split_spec(text);
  for (const SourceRow& row : kRows)
    if (spec.kind == row.name && (row.stands_alone || !spec.argument.empty()))
      return {&row, spec.argument};
  throw ConfigError("--source {}: not a source; use {}", text, all_forms());
}

std::string source_help() {
  std::string text = "where frames come from:\n";
  for (const SourceRow& row : kRows) {
    const std::string head = forms(row, " | ");
    text += *row.help == 0 ? fmt::format("  {}\n", head)
                           : fmt::format("  {:<28}  {}\n", head, row.help);
  }
  return text + "Without it: a camera that sees the tags, else sim";
}

std::string source_forms(std::initializer_list<SourceKind> kinds) {
  std::string text;
  for (const SourceRow& row : kRows) {
    if (std::find(kinds.begin(), kinds.end(), row.kind) == kinds.end()) continue;
    text += (text.empty() ? "" : " | ") + forms(row, " | ");
  }
  return text;
}

BenchInput open_at_bench(const InputOptions& options) {
  const SourceSpec spec = parse_source(options.source);
  if (!spec.is(SourceKind::simulator)) return {.input = open_input(options)};
  const sim::Scenario scenario = scenario_of(spec.argument);
  BenchInput at{.bench = std::make_unique<sim::Bench>(scenario.bench, scenario.seed)};
  at.input = simulated(options, scenario, at.bench.get());
  at.time_zero = static_cast<SimulatorSource&>(*at.input.source).time_zero();
  return at;
}

}  // namespace tagwrench
