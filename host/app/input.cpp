#include "host/app/input.h"

#include <fmt/format.h>
#include <poll.h>

#include <filesystem>
#include <utility>

#include "host/app/recording_sensor.h"
#include "host/app/scenario_config.h"
#include "host/core/config_error.h"
#include "host/core/log.h"
#include "host/core/os/termination.h"
#include "host/recording/reader.h"
#include "host/source/images.h"
#include "host/source/recording.h"
#include "host/source/simulator/folder_export.h"
#include "host/source/simulator/simulator_source.h"
#include "host/source/v4l2_source.h"
#include "host/tracker/appearance_check.h"

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

Input open_simulator(const InputOptions& options, const std::string& scenario_file) {
  const sim::Scenario scenario =
      scenario_file.empty() ? sim::Scenario{} : load_scenario(scenario_file);
  Input input;
  if (!given_sensor(options, input))
    built_in_sensor(sim::sensor_yaml(scenario), "the simulated sensor", input);
  input.source = std::make_unique<SimulatorSource>(scenario, !options.fast);
  return input;
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
  auto recording = std::make_unique<record::RecordingReader>(file);
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
  input.camera = true;
  return input;
}

}  // namespace

Spec split_spec(const std::string& spec) {
  const std::size_t colon = spec.find(':');
  if (colon == std::string::npos) return {spec, ""};
  return {spec.substr(0, colon), spec.substr(colon + 1)};
}

std::string paper_sensor_yaml() { return sim::sensor_yaml(sim::Scenario{}); }

namespace {

Input open_source(const InputOptions& options) {
  const Spec spec = split_spec(options.source);
  if (spec.kind == "sim") return open_simulator(options, spec.argument);
  if (spec.kind == "images" && !spec.argument.empty()) return open_images(options, spec.argument);
  if (spec.kind == "v4l2" && !spec.argument.empty()) return open_camera(options, spec.argument);
  if (spec.kind == "recording" && !spec.argument.empty())
    return open_recording(options, spec.argument);
  throw ConfigError(fmt::format(
      "--source {}: not a source; use sim, sim:SCENARIO.yaml, v4l2:/dev/videoN, images:DIR or "
      "recording:FILE",
      options.source));
}

}  // namespace

Input open_input(const InputOptions& options) {
  Input input = open_source(options);
  input.spec = options.source;
  return input;
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

void check_appearance(const Input& input) {
  const SensorConfig& sensor = input.sensor;
  const auto mismatch = check_appearance(sensor.camera, sensor.target, sensor.rest);
  if (!mismatch) return;
  throw ConfigError(fmt::format(
      "sensor.yaml: rest.appearance: the picture does not show tag {} of {} where the rest pose "
      "puts it (likeness {:.2f}); run `tagwrench calibrate target`, or remove rest.appearance",
      mismatch->id, name(sensor.target.family), mismatch->likeness));
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

}  // namespace tagwrench
