#include "host/app/input.h"

#include <fmt/format.h>
#include <poll.h>

#include <algorithm>
#include <utility>

#include "host/app/sources.h"
#include "host/core/config_error.h"
#include "host/core/log.h"
#include "host/core/os/termination.h"
#include "host/source/simulator/folder_export.h"
#include "host/tracker/appearance_check.h"

namespace tagwrench {

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
      "{}: the picture at rest does not show tag {} of {} where the rest pose puts it (likeness "
      "{:.2f}); run `tagwrench calibrate target`, or remove {}",
      sensor.target_from.file, mismatch->id, name(sensor.target.family), mismatch->likeness,
      sensor.target_from.file == InForce{}.file ? "rest.appearance" : "the file"));
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

}  // namespace tagwrench
