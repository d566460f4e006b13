#include "host/output/gadget_daemon.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <sys/file.h>
#include <sys/inotify.h>
#include <sys/socket.h>
#include <time.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstring>
#include <string_view>
#include <utility>

#include "host/core/config_error.h"
#include "host/core/os/uninterrupted.h"
#include "host/output/hid_report.h"

namespace tagwrench {
namespace {

using std::chrono::milliseconds;

constexpr milliseconds kPause{20};
constexpr milliseconds kAsleep{1000};    // nobody asks as rarely as this
constexpr milliseconds kLastWords{200};  // for who wants to go

std::string_view file_name(std::string_view path) noexcept {
  return path.substr(path.rfind('/') + 1);
}

}  // namespace

GadgetDaemon::GadgetDaemon(GadgetFace face, UniqueFd link, UniqueFd watch, OpenedNode node,
                           OpenNode open)
    : face_(face),
      reports_(face),
      link_(std::move(link)),
      watch_(std::move(watch)),
      node_(std::move(node)),
      open_(std::move(open)) {
  reports_.renew();
}

void GadgetDaemon::run() noexcept {
  tell_bridge(GadgetEvent::ready);
  while (true) {
    flush();
    if (ended_ && (!node_.fd || away_ || !reports_.owed())) return;
    wait();
  }
}

/// Writes what is owed, as far as there is room.
void GadgetDaemon::flush() noexcept {
  pause_ = false;
  while (node_.fd && reports_.owed()) {
    const std::span<const std::uint8_t> report = reports_.next();
    const ssize_t written = ::write(node_.fd.get(), report.data(), report.size());
    if (written == static_cast<ssize_t>(report.size())) {
      reports_.taken();
      away_ = waiting_ = free_ = false;
      readable_ = true;
      tell_state(GadgetEvent::taken);
    } else if (written >= 0 || errno != EINTR) {
      return refused(written < 0 ? errno : EIO);
    }
  }
}

void GadgetDaemon::refused(int error) noexcept {
  pause_ = std::exchange(free_, false);
  if (error != EAGAIN) {  // ESHUTDOWN: no cable, no computer, not set up
    away_ = true;
    waiting_ = false;
    reports_.renew();
    return tell_state(GadgetEvent::nobody);
  }
  away_ = false;
  if (!std::exchange(waiting_, true)) waiting_since_ = Clock::now();
  if (Clock::now() - waiting_since_ >= kAsleep) tell_state(GadgetEvent::asleep);
}

int GadgetDaemon::patience_ms() const noexcept {
  if (pause_) return static_cast<int>(kPause.count());
  const bool may_sleep = waiting_ && state_ != GadgetEvent::asleep;
  return may_sleep ? static_cast<int>(kAsleep.count()) : -1;
}

/// For the bridge, for room, for an output report, for the node's going or coming.
void GadgetDaemon::wait() noexcept {
  const bool wants_room = reports_.owed() && !pause_;
  const auto node_events =
      static_cast<short>((readable_ ? POLLIN : 0) | (wants_room ? POLLOUT : 0));
  std::array<pollfd, 3> fds{{{ended_ ? -1 : link_.get(), POLLIN, 0},
                             {watch_.get(), POLLIN, 0},
                             {node_.fd.get(), node_events, 0}}};
  if (::poll(fds.data(), fds.size(), patience_ms()) <= 0) return;
  if ((fds[2].revents & (POLLERR | POLLHUP | POLLNVAL)) != 0) lose_node();
  free_ = (fds[2].revents & POLLOUT) != 0;
  if (node_.fd && (fds[2].revents & POLLIN) != 0) take_output();
  if (fds[1].revents != 0) take_watch();
  if (fds[0].revents != 0) take_link();
}

void GadgetDaemon::take_link() noexcept {
  std::array<std::uint8_t, 256> message;
  while (true) {
    const ssize_t got = ::recv(link_.get(), message.data(), message.size(), MSG_DONTWAIT);
    if (got < 0 && errno == EAGAIN) return;
    if (got < 0 && errno == EINTR) continue;
    if (got <= 0) break;
    reports_.put({message.data(), static_cast<std::size_t>(got)});
  }
  ended_ = true;
  reports_.rest();
  if (node_.fd) ::flock(node_.fd.get(), LOCK_UN);  // the next bridge need not wait
}

/// The LED; whatever else comes is no report of ours.
void GadgetDaemon::take_output() noexcept {
  std::array<std::uint8_t, 256> report;
  const ssize_t got = ::read(node_.fd.get(), report.data(), report.size());
  if (got <= 0) {
    readable_ = got < 0 && (errno == EAGAIN || errno == EINTR);
    return;
  }
  if (got < 2 || report[0] != kSpacemouseLedReportId) return;
  const GadgetEvent led = (report[1] & 1) != 0 ? GadgetEvent::led_on : GadgetEvent::led_off;
  if (std::exchange(led_, led) != led) tell_bridge(led);
}

void GadgetDaemon::take_watch() noexcept {
  alignas(inotify_event) std::array<char, 4096> buffer;
  bool look = false;
  while (true) {
    const ssize_t got = ::read(watch_.get(), buffer.data(), buffer.size());
    if (got <= 0) break;
    for (std::size_t at = 0; at + sizeof(inotify_event) <= static_cast<std::size_t>(got);) {
      inotify_event event;
      std::memcpy(&event, buffer.data() + at, sizeof event);
      const std::string_view name =
          event.len > 0 ? buffer.data() + at + sizeof event : std::string_view();
      const bool lost = (event.mask & IN_Q_OVERFLOW) != 0;
      if (lost || ((event.mask & IN_DELETE) != 0 && name == file_name(node_.path))) lose_node();
      look = look || lost || (event.mask & IN_DELETE) == 0;
      at += sizeof event + event.len;
    }
  }
  if (look && !node_.fd) find_node();
}

void GadgetDaemon::lose_node() noexcept {
  if (node_.fd) rest_gadget(node_.fd.get(), face_);
  node_ = {};
  away_ = waiting_ = false;
  tell_state(GadgetEvent::gone);
}

void GadgetDaemon::find_node() noexcept {
  if (ended_) return;
  OpenedNode found = open_();
  if (!found.fd) return;
  node_ = std::move(found);
  readable_ = true;
  reports_.renew();
}

void GadgetDaemon::tell_state(GadgetEvent state) noexcept {
  if (std::exchange(state_, state) != state) tell_bridge(state);
}

void GadgetDaemon::tell_bridge(GadgetEvent status_line) noexcept {
  if (!ended_) ::send(link_.get(), &status_line, sizeof status_line, MSG_DONTWAIT | MSG_NOSIGNAL);
}

UniqueFd watch_nodes(const std::string& folder) {
  UniqueFd watch(::inotify_init1(IN_CLOEXEC | IN_NONBLOCK));
  constexpr std::uint32_t kEvents = IN_CREATE | IN_DELETE | IN_ATTRIB;
  if (!watch || ::inotify_add_watch(watch.get(), folder.c_str(), kEvents) < 0) {
    throw ConfigError(
        fmt::format("gadget: {} cannot be watched: {}; more may be allowed with: sudo sysctl "
                    "fs.inotify.max_user_instances=512",
                    folder, std::strerror(errno)));
  }
  return watch;
}

void rest_gadget(int node, GadgetFace face) noexcept {
  GadgetReports reports(face);
  reports.renew();
  const auto end = std::chrono::steady_clock::now() + kLastWords;
  const auto wait_for_room = [node, end] {
    const auto left =
        std::chrono::ceil<milliseconds>(end - std::chrono::steady_clock::now()).count();
    pollfd room{node, POLLOUT, 0};
    if (left <= 0) return false;
    const int ready = ::poll(&room, 1, static_cast<int>(left));
    return ready > 0 || (ready < 0 && errno == EINTR);
  };
  while (reports.owed()) {
    const std::span<const std::uint8_t> report = reports.next();
    if (uninterrupted([&] { return ::write(node, report.data(), report.size()); }) >= 0) {
      reports.taken();
    } else if (errno != EAGAIN || !wait_for_room()) {
      return;
    }
  }
  wait_for_room();
}

void rest_before_the_end(const OpenedNode& node, GadgetFace face) noexcept {
  if (node.fd) return rest_gadget(node.fd.get(), face);
  if (node.error != EWOULDBLOCK) return;
  const UniqueFd held(::open(node.path.c_str(), O_RDWR | O_NONBLOCK | O_CLOEXEC | O_NOFOLLOW));
  if (!held || ::unlink(node.path.c_str()) != 0) return;
  const auto end = std::chrono::steady_clock::now() + 2 * kLastWords;
  constexpr timespec kMoment{0, 5'000'000};
  while (::flock(held.get(), LOCK_EX | LOCK_NB) != 0 && std::chrono::steady_clock::now() < end)
    ::nanosleep(&kMoment, nullptr);
}

}  // namespace tagwrench
