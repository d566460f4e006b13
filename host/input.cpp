#include "host/input.h"

#include <fmt/format.h>
#include <poll.h>
#include <sys/signalfd.h>

#include <csignal>
#include <filesystem>
#include <functional>

#include "host/config/scenario_config.h"
#include "host/config_error.h"
#include "host/source/images.h"
#include "host/source/simulator/folder_export.h"
#include "host/source/simulator/simulator_source.h"
#include "host/source/v4l2_source.h"
#include "host/tell.h"
#include "host/tracker/appearance_check.h"

namespace tagwrench {
namespace {

/// They wait until the loop reads them.
sigset_t block_signals() {
  sigset_t signals;
  sigemptyset(&signals);
  for (int signal : {SIGINT, SIGTERM, SIGHUP}) sigaddset(&signals, signal);
  sigprocmask(SIG_BLOCK, &signals, nullptr);
  return signals;
}

SensorConfig sensor_or(const InputOptions& options, const std::function<SensorConfig()>& fallback) {
  return options.sensor.empty() ? fallback() : load_sensor(options.sensor);
}

SensorConfig paper_sensor() { return parse_sensor(paper_sensor_yaml(), "the built-in sensor"); }

Input open_simulator(const InputOptions& options, const std::string& scenario_file) {
  const sim::Scenario scenario =
      scenario_file.empty() ? sim::Scenario{} : load_scenario(scenario_file);
  Input input;
  input.sensor = sensor_or(
      options, [&] { return parse_sensor(sim::sensor_yaml(scenario), "the simulated sensor"); });
  input.source = std::make_unique<SimulatorSource>(scenario, !options.fast);
  return input;
}

Input open_images(const InputOptions& options, const std::string& folder) {
  const std::filesystem::path beside = std::filesystem::path(folder) / "sensor.yaml";
  Input input;
  input.sensor = sensor_or(options, [&] {
    std::error_code unreadable;  // the source itself will complain
    return std::filesystem::exists(beside, unreadable) ? load_sensor(beside) : paper_sensor();
  });
  input.source = std::make_unique<ImagesSource>(folder, options.fast);
  return input;
}

Input open_camera(const InputOptions& options, const std::string& argument) {
  Input input;
  input.sensor = sensor_or(options, paper_sensor);
  V4l2Options camera = parse_v4l2_spec(argument);
  camera.preferred_width = input.sensor.camera.width_px;
  camera.preferred_height = input.sensor.camera.height_px;
  block_signals();  // from here on the camera's settings must be put back
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

Input open_input(const InputOptions& options) {
  const Spec spec = split_spec(options.source);
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

void check_appearance(const Input& input) {
  const SensorConfig& sensor = input.sensor;
  const auto mismatch = check_appearance(sensor.camera, sensor.target, sensor.rest);
  if (!mismatch) return;
  throw ConfigError(fmt::format(
      "sensor.yaml: rest.appearance: the picture does not show tag {} of {} where the rest pose "
      "puts it (likeness {:.2f}); run `tagwrench calibrate target`, or remove rest.appearance",
      mismatch->id, name(sensor.target.family), mismatch->likeness));
}

UniqueFd signals_as_fd() {
  const sigset_t signals = block_signals();
  return UniqueFd(::signalfd(-1, &signals, SFD_CLOEXEC | SFD_NONBLOCK));
}

bool signalled(const UniqueFd& stop) {
  pollfd entry{stop.get(), POLLIN, 0};
  return ::poll(&entry, 1, 0) > 0;
}

Next next_frame(FrameSource& source, const UniqueFd& stop, Frame& frame) {
  constexpr int kPatience_ms = 200;
  pollfd fds[2] = {{source.poll_fd(), POLLIN, 0}, {stop.get(), POLLIN, 0}};
  ::poll(fds, 2, source.poll_fd() < 0 ? 0 : kPatience_ms);
  if (fds[1].revents != 0) return Next::stopped;
  const ReadStatus status = source.read(frame);
  if (status == ReadStatus::end) return Next::end;
  if (status == ReadStatus::disconnected || status == ReadStatus::reconnected)
    tell(source.detail());
  return status == ReadStatus::frame ? Next::frame : Next::nothing;
}

}  // namespace tagwrench
