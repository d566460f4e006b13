#include "host/app/run.h"

#include <fmt/format.h>
#include <poll.h>
#include <spawn.h>
#include <sys/inotify.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <chrono>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <memory>
#include <span>
#include <string_view>
#include <utility>

#include "host/app/instrument.h"
#include "host/core/config_error.h"
#include "host/core/log.h"
#include "host/core/os/termination.h"
#include "host/core/os/uninterrupted.h"
#include "host/core/os/unique_fd.h"
#include "host/core/os/user_folders.h"
#include "host/output/hid_outputs.h"
#include "host/sensor/sensor_config.h"
#include "host/source/v4l2_device.h"
#include "host/source/v4l2_source.h"
#include "host/tracker/tracker.h"
#include "host/web/bridge/recording_folder.h"
#include "host/web/server/web_options.h"

namespace tagwrench {
namespace {

namespace fs = std::filesystem;

/// A board lives in real time.
void check_board(const RunOptions& options, std::span<const OutputSpec> outputs) {
  const OutputSpec* reference = find_output(outputs, OutputKind::reference);
  if (options.board.empty()) {
    if (!options.cells.empty())
      throw ConfigError("--cells: the load cells are a board's; name its port with --board");
    if (reference != nullptr) {
      throw ConfigError("--output {}: the load cells are a board's; name its port with --board",
                        reference->text());
    }
    return;
  }
  if (options.fast)
    throw ConfigError("--fast: a board has its own time; leave it out, or leave out --board");
  if (!options.source.empty() && parse_source(options.source).row->own_time) {
    throw ConfigError(
        "--source {}: these pictures are of another time than what the board says now; leave out "
        "--board",
        options.source);
  }
}

/// In the browser of the desktop, where there is one; the shell leaves it to itself, and Ctrl-C in
/// our terminal too. Every user of the machine can read the address, in the list of processes.
void open_in_browser(const std::string& url) {
  if (std::getenv("DISPLAY") == nullptr && std::getenv("WAYLAND_DISPLAY") == nullptr) return;
  std::string shell = "sh", option = "-c", command = "xdg-open \"$0\" >/dev/null 2>&1 </dev/null &",
              address = url;
  char* const arguments[] = {shell.data(), option.data(), command.data(), address.data(), nullptr};
  posix_spawnattr_t own_session;
  ::posix_spawnattr_init(&own_session);
  ::posix_spawnattr_setflags(&own_session, POSIX_SPAWN_SETSID);
  pid_t pid = 0;
  if (::posix_spawn(&pid, "/bin/sh", nullptr, &own_session, arguments, environ) == 0)
    uninterrupted([&] { return ::waitpid(pid, nullptr, 0); });
  ::posix_spawnattr_destroy(&own_session);
}

/// Whether there are pages. Throws ConfigError where options are theirs, and they are not there.
bool has_web(const RunOptions& options, std::span<const OutputSpec> outputs) {
  if (find_output(outputs, OutputKind::pages) != nullptr || options.web.open) return true;
  if (!options.web.token_file.empty())
    throw ConfigError("--web-token: is for pages; add --output web:ADDRESS:PORT");
  if (!options.web.recordings.empty())
    throw ConfigError("--recordings: is for pages; add --output web");
  return false;
}

/// Binds, serves, and says where.
std::unique_ptr<WebBridge> open_web(const RunOptions& options, std::span<const OutputSpec> outputs,
                                    const UniqueFd& stop) {
  WebBridgeOptions web;
  const OutputSpec* spec = find_output(outputs, OutputKind::pages);
  web.server = parse_web("--output web", spec == nullptr ? "" : spec->argument);
  web.server.pages = options.web.pages.empty() ? built_pages() : fs::path(options.web.pages);
  if (!options.web.token_file.empty()) web.server.token = web_token(options.web.token_file);
  web.recordings = options.web.recordings.empty() ? usual_recording_folder()
                                                  : fs::absolute(options.web.recordings);
  if (const std::string folder = config_folder(); !folder.empty())
    web.own_profiles = fs::path(folder) / "profiles";
  auto bridge = std::make_unique<WebBridge>(web, stop.get());
  if (web.server.token.empty()) {
    log_info("pages: {}", bridge->url());
    if (::geteuid() == 0 && std::getenv("SUDO_UID") != nullptr)
      log_info("pages: for root alone; run it as yourself, or give --web-token FILE");
  } else {
    log_info("pages: {}#token={}", bridge->url(),
             token_for_people(web.server.token, options.web.token_file));
  }
  bridge->start();
  if (options.web.open) open_in_browser(bridge->local_url());
  return bridge;
}

/// What goes on while there is no run.
std::vector<Output*> beside(RunSession& session) {
  session.outputs.close_for_job();
  std::vector<Output*> all = session.outputs.all();
  if (session.watch) all.push_back(session.watch.get());
  return all;
}

/// Whether the source shows the sensor's tags within `patience`. A signal ends the search; the loop
/// then sees it too. systemd, if any, gets signs of life: many cameras take longer than it waits.
bool sees_tags(Input& input, Duration patience, ServiceWatch* watch) {
  Tracker tracker = make_tracker(input.sensor);
  const UniqueFd stop = termination_fd();
  const TimePoint until = std::chrono::steady_clock::now() + patience;
  for (TimePoint now; (now = std::chrono::steady_clock::now()) < until;) {
    pollfd fds[3] = {{input.source->poll_fd(), POLLIN, 0},
                     {stop.get(), POLLIN, 0},
                     {watch != nullptr ? watch->poll_fd() : -1, POLLIN, 0}};
    const auto left = std::chrono::duration_cast<std::chrono::milliseconds>(until - now);
    if (::poll(fds, 3, static_cast<int>(left.count()) + 1) <= 0) continue;
    if (fds[1].revents != 0) return true;
    if (fds[2].revents != 0) watch->service();
    if (fds[0].revents == 0) continue;
    Frame frame;
    if (input.source->read(frame) != ReadStatus::frame) continue;
    const Track track = tracker.track(frame);
    if (track.tags_held > 0 || track.diagnostic == Diagnostic::image_looks_mirrored) return true;
  }
  return false;
}

/// The first camera that sees the tags, and how many cameras there are.
std::optional<Input> find_camera(const RunOptions& options, ServiceWatch* watch, int& cameras) {
  constexpr Duration kPatience = std::chrono::seconds(2);
  for (const CameraNode& node : list_camera_nodes()) {
    if (!node.captures) continue;
    try {
      Input input = open_input({options.sensor, "v4l2:" + node.path, options.fast});
      ++cameras;
      if (input.source->format().width == input.sensor.camera.width_px &&
          sees_tags(input, kPatience, watch))
        return input;
    } catch (const ConfigError& e) {
      log_info(e.what());
    }
  }
  return std::nullopt;
}

/// That camera; the simulated sensor where there is none.
Input find_input(const RunOptions& options, ServiceWatch* watch) {
  int cameras = 0;
  if (std::optional<Input> input = find_camera(options, watch, cameras)) return std::move(*input);
  log_info(cameras == 0 ? "no camera found: showing the simulated sensor (--source "
                          "v4l2:/dev/videoN picks a camera)"
                        : "no camera sees the tags: showing the simulated sensor (--source "
                          "v4l2:/dev/videoN insists)");
  return open_input({"", "sim", options.fast});  // --sensor describes the camera that is not there
}

/// The camera that was asked for, if it can be had now.
std::optional<Input> try_camera(const RunOptions& options, ServiceWatch* watch) {
  int cameras = 0;
  if (options.source.empty()) return find_camera(options, watch, cameras);
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

int run(const RunOptions& given) {
  const UniqueFd caught = termination_fd();  // what comes while it is set up ends it in order, too
  const std::vector<OutputSpec> asked = parse_outputs(given.outputs);  // refused before anything
  check_board(given, asked);                                           // is opened or lit
  check_sensor_name(given.name);
  const bool pages = has_web(given, asked);
  RunSession session{with_own_sensor(given), asked};
  if (session.options.record) check_recording(*session.options.record);
  const UniqueFd stop = termination_fd();
  if (pages) session.pages = open_web(session.options, asked, stop);
  // One run after the other, as pages want the camera and give it back.
  for (bool first = true;; first = false) {
    std::string failure;
    try {
      const std::unique_ptr<Instrument> instrument = Instrument::build(session);
      if (!instrument) return 0;
      const RunReport report = instrument->pipeline().run(instrument->limits());
      const bool lent = report.end == RunReport::End::interrupted && !termination_requested();
      if (!lent || !pages) return instrument->end(report);
      instrument->lend(report);
    } catch (const ConfigError& e) {
      if (first) throw;
      failure = e.what();
      log_info(failure);
    }
    const bool again = failure.empty() ? session.pages->lend_camera(beside(session))
                                       : session.pages->wait_after(failure, beside(session));
    if (!again) return 0;
  }
}

std::optional<Input> open_run_input(const RunOptions& options, ServiceWatch* watch) {
  if (!options.sensor.empty())
    load_sensor(options.sensor);  // a mistake in it must not look like a missing camera
  if (options.wait && wants_camera(options)) {
    if (!options.source.empty()) parse_v4l2_spec(parse_source(options.source).argument);
    return wait_for_camera([&] { return try_camera(options, watch); }, watch);
  }
  if (options.source.empty()) return find_input(options, watch);
  InputOptions input{options.sensor, options.source, options.fast};
  input.if_damaged = if_damaged(options.despite_damage);
  return open_input(input);
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
