#include "host/app/run_input.h"

#include <fmt/format.h>
#include <poll.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <cstring>
#include <utility>

#include "host/app/camera_wait.h"
#include "host/app/sources.h"
#include "host/core/config_error.h"
#include "host/core/log.h"
#include "host/core/os/config_folder.h"
#include "host/core/os/termination.h"
#include "host/sensor/sensor_config.h"
#include "host/source/v4l2_nodes.h"
#include "host/source/v4l2_source.h"
#include "host/tracker/tracker.h"

namespace tagwrench {
namespace {

/// Whether the source shows the sensor's tags within `patience`. A signal ends the search; the loop
/// then sees it too.
bool sees_tags(Input& input, Duration patience) {
  Tracker tracker = make_tracker(input.sensor);
  const UniqueFd stop = termination_fd();
  const TimePoint until = std::chrono::steady_clock::now() + patience;
  for (TimePoint now; (now = std::chrono::steady_clock::now()) < until;) {
    pollfd fds[2] = {{input.source->poll_fd(), POLLIN, 0}, {stop.get(), POLLIN, 0}};
    const auto left = std::chrono::duration_cast<std::chrono::milliseconds>(until - now);
    if (::poll(fds, 2, static_cast<int>(left.count()) + 1) <= 0) continue;
    if (fds[1].revents != 0) return true;
    Frame frame;
    if (input.source->read(frame) != ReadStatus::frame) continue;
    const Track track = tracker.track(frame);
    if (track.tags_held > 0 || track.diagnostic == Diagnostic::image_looks_mirrored) return true;
  }
  return false;
}

/// The first camera that sees the tags, and how many cameras there are.
std::optional<Input> find_camera(const RunOptions& options, int& cameras) {
  constexpr Duration kPatience = std::chrono::seconds(2);
  for (const CameraNode& node : list_camera_nodes()) {
    if (!node.captures) continue;
    try {
      Input input = open_input({options.sensor, "v4l2:" + node.path, options.fast});
      ++cameras;
      if (input.source->format().width == input.sensor.camera.width_px &&
          sees_tags(input, kPatience))
        return input;
    } catch (const ConfigError& e) {
      log_info(e.what());
    }
  }
  return std::nullopt;
}

/// That camera; the simulated sensor where there is none.
Input find_input(const RunOptions& options) {
  int cameras = 0;
  if (std::optional<Input> input = find_camera(options, cameras)) return std::move(*input);
  log_info(cameras == 0
               ? "no camera found: showing the simulated sensor (--source v4l2:/dev/videoN "
                 "picks a camera)"
               : "no camera sees the tags: showing the simulated sensor (--source "
                 "v4l2:/dev/videoN insists)");
  return open_input({"", "sim", options.fast});  // --sensor describes the camera that is not there
}

/// The camera that was asked for, if it can be had now.
std::optional<Input> try_camera(const RunOptions& options) {
  int cameras = 0;
  if (options.source.empty()) return find_camera(options, cameras);
  try {
    return open_input({options.sensor, options.source, options.fast});
  } catch (const ConfigError& e) {
    log_info(e.what());
    return std::nullopt;
  }
}

bool wants_camera(const RunOptions& options) {
  return options.source.empty() || parse_source(options.source).is(SourceKind::camera);
}

}  // namespace

std::optional<Input> open_run_input(const RunOptions& options, ServiceWatch* watch) {
  if (!options.sensor.empty())
    load_sensor(options.sensor);  // a mistake in it must not look like a missing camera
  if (options.wait && wants_camera(options)) {
    if (!options.source.empty()) parse_v4l2_spec(parse_source(options.source).argument);
    return wait_for_camera([&] { return try_camera(options); }, watch);
  }
  if (options.source.empty()) return find_input(options);
  return open_input({options.sensor, options.source, options.fast});
}

RunOptions with_own_sensor(RunOptions options) {
  const std::string folder = config_folder();
  const std::string file = folder + "/sensor.yaml";
  if (!options.sensor.empty() || !wants_camera(options) || folder.empty()) return options;
  struct stat found {};
  if (::lstat(file.c_str(), &found) == 0) {
    options.sensor = file;
    log_info("sensor: " + file);
  } else if (errno != ENOENT && errno != ENOTDIR) {
    throw ConfigError(file + ": cannot be looked at: " + std::strerror(errno) +
                      "; make its folder yours, or name a file with --sensor");
  }
  return options;
}

}  // namespace tagwrench
