#include "host/app/run_input.h"

#include <fmt/format.h>
#include <poll.h>
#include <sys/inotify.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <string>
#include <string_view>
#include <utility>

#include "host/app/input.h"
#include "host/core/config_error.h"
#include "host/core/log.h"
#include "host/core/os/termination.h"
#include "host/core/os/unique_fd.h"
#include "host/core/os/user_folders.h"
#include "host/sensor/sensor_config.h"
#include "host/source/v4l2_device.h"
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
  log_info(cameras == 0 ? "no camera found: showing the simulated sensor (--source "
                          "v4l2:/dev/videoN picks a camera)"
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

constexpr const char* kWaiting = "waiting for a camera that sees the tags";
// udev gives a new node its permissions and its links in /dev/v4l one after the other.
constexpr int kSettle_ms = 500;

UniqueFd watch_dev() {
  UniqueFd events(::inotify_init1(IN_CLOEXEC | IN_NONBLOCK));
  if (!events || ::inotify_add_watch(events.get(), "/dev", IN_CREATE | IN_ATTRIB) < 0)
    throw ConfigError(std::string("/dev: cannot be watched for a camera to come: ") +
                      std::strerror(errno) + "; see /proc/sys/fs/inotify, or leave out --wait");
  return events;
}

/// Whether one of the events is a camera's. Takes all of them.
bool takes_camera_event(int events) {
  alignas(inotify_event) std::array<char, 4096> bytes;
  bool camera = false;
  for (ssize_t size; (size = ::read(events, bytes.data(), bytes.size())) > 0;) {
    for (ssize_t at = 0; at < size;) {
      const auto* event = reinterpret_cast<const inotify_event*>(bytes.data() + at);
      const std::string_view name = event->len > 0 ? event->name : "";
      camera = camera || name.starts_with("video") || (event->mask & IN_Q_OVERFLOW) != 0;
      at += static_cast<ssize_t>(sizeof(inotify_event) + event->len);
    }
  }
  return camera;
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

std::optional<Input> wait_for_camera(const std::function<std::optional<Input>()>& look,
                                     ServiceWatch* watch) {
  const UniqueFd events = watch_dev();  // before the first look, or a camera might come in between
  const UniqueFd stop = termination_fd();
  if (std::optional<Input> input = look()) return input;
  log_info(kWaiting);
  if (watch != nullptr) watch->ready(kWaiting);
  for (bool came = false;;) {
    std::array<pollfd, 3> fds{{{events.get(), POLLIN, 0},
                               {stop.get(), POLLIN, 0},
                               {watch != nullptr ? watch->poll_fd() : -1, POLLIN, 0}}};
    const int ready = ::poll(fds.data(), fds.size(), came ? kSettle_ms : -1);
    if (fds[1].revents != 0) return std::nullopt;
    if (fds[2].revents != 0) watch->service();
    if (fds[0].revents != 0) came = takes_camera_event(events.get()) || came;
    if (ready != 0 || !came) continue;
    came = false;
    if (std::optional<Input> input = look()) return input;
  }
}

}  // namespace tagwrench
