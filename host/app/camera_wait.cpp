#include "host/app/camera_wait.h"

#include <poll.h>
#include <sys/inotify.h>

#include <array>
#include <cerrno>
#include <cstring>
#include <string>
#include <string_view>

#include "host/core/config_error.h"
#include "host/core/log.h"
#include "host/core/os/termination.h"
#include "host/core/os/unique_fd.h"

namespace tagwrench {
namespace {

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
