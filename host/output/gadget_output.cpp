#include "host/output/gadget_output.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <signal.h>
#include <sys/file.h>
#include <sys/inotify.h>
#include <sys/prctl.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <string_view>
#include <utility>

#include "host/core/config_error.h"
#include "host/core/os/child_process.h"
#include "host/core/os/termination.h"
#include "host/core/os/uninterrupted.h"
#include "host/output/hid_report.h"

// Not fuzzed: messages of our own daemon, of fixed size, and its reports.

namespace tagwrench {
namespace {

/// Of a SpaceMouse's motion report.
Counts6 counts_of(const std::uint8_t* report) noexcept {
  Counts6 counts;
  for (std::size_t i = 0; i < counts.size(); ++i)
    counts[i] = static_cast<std::int16_t>(report[1 + 2 * i] | report[2 + 2 * i] << 8);
  return counts;
}

using std::chrono::milliseconds;

constexpr milliseconds kPause{20};
constexpr milliseconds kAsleep{1000};    // nobody asks as rarely as this
constexpr milliseconds kLastWords{200};  // for who wants to go

std::string_view file_name(std::string_view path) noexcept {
  return path.substr(path.rfind('/') + 1);
}

class GadgetDaemon {
 public:
  GadgetDaemon(GadgetFace face, UniqueFd link, UniqueFd watch, OpenedNode node, OpenGadgetNode open)
      : face_(face),
        reports_(face),
        link_(std::move(link)),
        watch_(std::move(watch)),
        node_(std::move(node)),
        open_(std::move(open)) {
    reports_.renew();
  }

  /// Until the bridge is gone and nothing is owed.
  void run() noexcept {
    tell_bridge(GadgetEvent::ready);
    while (true) {
      flush();
      if (ended_ && (!node_.fd || away_ || !reports_.owed())) return;
      wait();
    }
  }

 private:
  using Clock = std::chrono::steady_clock;

  /// Writes what is owed, as far as there is room.
  void flush() noexcept {
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

  void refused(int error) noexcept {
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

  int patience_ms() const noexcept {
    if (pause_) return static_cast<int>(kPause.count());
    const bool may_sleep = waiting_ && state_ != GadgetEvent::asleep;
    return may_sleep ? static_cast<int>(kAsleep.count()) : -1;
  }

  /// For the bridge, for room, for an output report, for the node's going or coming.
  void wait() noexcept {
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

  void take_link() noexcept {
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
  void take_output() noexcept {
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

  void take_watch() noexcept {
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

  void lose_node() noexcept {
    if (node_.fd) rest_gadget(node_.fd.get(), face_);
    node_ = {};
    away_ = waiting_ = false;
    tell_state(GadgetEvent::gone);
  }

  void find_node() noexcept {
    if (ended_) return;
    OpenedNode found = open_();
    if (!found.fd) return;
    node_ = std::move(found);
    readable_ = true;
    reports_.renew();
  }

  void tell_state(GadgetEvent state) noexcept {
    if (std::exchange(state_, state) != state) tell_bridge(state);
  }

  void tell_bridge(GadgetEvent event) noexcept {
    if (!ended_) ::send(link_.get(), &event, sizeof event, MSG_DONTWAIT | MSG_NOSIGNAL);
  }

  GadgetFace face_;
  GadgetReports reports_;
  UniqueFd link_;
  UniqueFd watch_;
  OpenedNode node_;
  OpenGadgetNode open_;
  bool ended_ = false;    ///< the bridge is gone
  bool away_ = false;     ///< nobody takes reports: nothing can be stuck
  bool free_ = false;     ///< poll() has said that a write is possible
  bool pause_ = false;    ///< and it was not: not to be asked again at once
  bool readable_ = true;  ///< false after an error, until a report is taken
  bool waiting_ = false;  ///< a report was refused because there is one before it
  Clock::time_point waiting_since_{};
  GadgetEvent state_ = GadgetEvent::none;
  GadgetEvent led_ = GadgetEvent::led_off;
};

constexpr std::uint16_t k3dconnexion = 0x256f;
constexpr int kStart_ms = 10'000;  // of a daemon on a busy machine
constexpr int kPatience_ms = 300;  // with a computer that takes rest in its own time

using Packet =
    std::array<std::uint8_t, SpacemouseReport().size() + SpacemouseButtonReport().size()>;

Packet packet(const Counts6& counts, std::uint32_t pressed) noexcept {
  Packet bytes;
  const SpacemouseReport motion = spacemouse_report(counts);
  const SpacemouseButtonReport buttons = spacemouse_button_report(pressed);
  std::copy(motion.begin(), motion.end(), bytes.begin());
  std::copy(buttons.begin(), buttons.end(), bytes.begin() + motion.size());
  return bytes;
}

std::vector<std::uint8_t> neutral(GadgetFace face) {
  if (face == GadgetFace::spacemouse) {
    const Packet rest = packet({}, 0);
    return {rest.begin(), rest.end()};
  }
  const WrenchReport rest = neutral_wrench_report();
  return {rest.begin(), rest.end()};
}

std::string_view news_text(GadgetEvent event) noexcept {
  constexpr std::array<std::string_view, 8> kTexts = {
      "",
      "",
      "gadget: the other computer takes reports",
      "gadget: no computer at the other end; goes on when there is one",
      "gadget: the other computer does not ask for reports (asleep?); goes on when it does",
      "gadget: it was taken down; goes on after `tagwrench gadget up`",
      "gadget: LED off",
      "gadget: LED on"};
  const auto at = static_cast<std::size_t>(event);
  return at < kTexts.size() ? kTexts[at] : std::string_view();
}

std::string up_command(const GadgetOptions& options) {
  std::string command = "sudo tagwrench gadget up";
  if (options.face.value_or(GadgetFace::spacemouse) != GadgetFace::spacemouse)
    command += fmt::format(" --face {}", face_name(*options.face));
  if (options.name != GadgetOptions().name) command += " --name " + options.name;
  return command;
}

[[noreturn]] void no_daemon(const char* what, const char* why) {
  throw ConfigError("gadget: {}: {}; end other programs", what, why);
}

[[noreturn]] void cannot_open(const GadgetOptions& options, const OpenedNode& node) {
  const std::string which = std::string(kGadgetPrefix) + options.name;
  if (node.error == EWOULDBLOCK) {
    throw ConfigError(
        "gadget {}: another bridge writes to {}; stop it, or give this one a gadget of its own",
        which, node.path);
  }
  if (node.error == EACCES || node.error == EPERM) {
    throw ConfigError(
        "gadget {}: {}: permission denied; install 70-tagwrench.rules in /etc/udev/rules.d and "
        "join the group tagwrench, or run as root",
        which, node.path);
  }
  throw ConfigError("gadget {}: {}: {}; make it anew: {}", which,
                    node.path.empty() ? "no device node" : node.path,
                    std::strerror(node.error == 0 ? ENOENT : node.error), up_command(options));
}

}  // namespace

GadgetReports::GadgetReports(GadgetFace face) noexcept : face_(face) {
  const auto add = [this](std::span<const std::uint8_t> neutral, bool stream, bool axes) {
    Kind& kind = kinds_[count_++];
    kind.id = neutral[0];
    kind.size = neutral.size();
    kind.stream = stream;
    kind.axes = axes;
    std::copy(neutral.begin(), neutral.end(), kind.newest.begin());
    kind.last = kind.newest;
  };
  if (face == GadgetFace::spacemouse) {
    add(spacemouse_button_report(0), false, false);
    add(spacemouse_report({}), true, true);
  } else {
    add(neutral_wrench_report(), true, false);
  }
}

void GadgetReports::put(std::span<const std::uint8_t> reports) noexcept {
  while (!reports.empty()) {
    const auto kind = std::ranges::find(kinds(), reports[0], &Kind::id);
    if (kind == kinds().end() || reports.size() < kind->size) return;
    const std::span<const std::uint8_t> report = reports.first(kind->size);
    std::ranges::copy(report, kind->newest.begin());
    const bool changed = !std::equal(report.begin(), report.end(), kind->last.begin());
    kind->owed = kind->owed || kind->stream || changed;
    reports = reports.subspan(kind->size);
  }
}

GadgetReports::Kind* GadgetReports::first_owed() noexcept {
  const auto kind = std::ranges::find(kinds(), true, &Kind::owed);
  return kind == kinds().end() ? nullptr : &*kind;
}

std::span<const std::uint8_t> GadgetReports::next() noexcept {
  const Kind* kind = first_owed();
  if (kind == nullptr) return {};
  if (!kind->axes) return kind->bytes();
  const SpacemouseReport report =
      spacemouse_report(dithered(counts_of(kind->newest.data()), counts_of(kind->last.data())));
  std::copy(report.begin(), report.end(), out_.begin());
  return {out_.data(), report.size()};
}

void GadgetReports::taken() noexcept {
  const std::span<const std::uint8_t> written = next();
  Kind* kind = first_owed();
  if (kind == nullptr) return;
  kind->owed = false;
  std::copy(written.begin(), written.end(), kind->last.begin());
}

void run_gadget_daemon(GadgetFace face, UniqueFd link, UniqueFd watch, OpenedNode node,
                       OpenGadgetNode open) noexcept {
  GadgetDaemon(face, std::move(link), std::move(watch), std::move(node), std::move(open)).run();
}

UniqueFd watch_nodes(const std::string& folder) {
  UniqueFd watch(::inotify_init1(IN_CLOEXEC | IN_NONBLOCK));
  constexpr std::uint32_t kEvents = IN_CREATE | IN_DELETE | IN_ATTRIB;
  if (!watch || ::inotify_add_watch(watch.get(), folder.c_str(), kEvents) < 0) {
    throw ConfigError(
        "gadget: {} cannot be watched: {}; more may be allowed with: sudo sysctl "
        "fs.inotify.max_user_instances=512",
        folder, std::strerror(errno));
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
    if (uninterrupted([&] { return ::write(node, report.data(), report.size()); }) >= 0)
      reports.taken();
    else if (errno != EAGAIN || !wait_for_room())
      return;
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

GadgetPort find_gadget(const GadgetOptions& options) {
  GadgetFiles files;
  const GadgetTree tree(files, options.places.gadgets());
  const std::optional<GadgetFound> found = tree.find(options.name);
  const std::string which = std::string(kGadgetPrefix) + options.name;
  if (!found || !found->whole || !found->face)
    throw ConfigError("gadget {}: it is not up; make it: {}", which, up_command(options));
  if (options.face && options.face != found->face) {
    throw ConfigError("gadget {}: it is up with the face {}; use that one, or: {}", which,
                      face_name(*found->face), up_command(options));
  }
  GadgetPort port;
  port.face = *found->face;
  port.spnav_order = found->id.vendor != k3dconnexion;
  port.places = options.places;
  port.function = tree.function(options.name, port.face);
  port.node = open_gadget_node(files, port.places, port.function);
  if (!port.node.fd) cannot_open(options, port.node);
  return port;
}

void keep_gadget(const GadgetInheritance& given) {
  ::prctl(PR_SET_NAME, "tw-gadget");  // so that a kill by the bridge's name spares it
  ignore_signals();                   // Ctrl-C is for the bridge: the daemon ends with its link
  UniqueFd link(kFirstDaemonFd), watch(kFirstDaemonFd + 1);
  OpenedNode node;
  node.fd.reset(kFirstDaemonFd + 2);
  node.path = given.node;
  for (const UniqueFd* fd : {&link, &watch, &node.fd}) {
    // A bridge's they are not if the verb is typed.
    if (::fcntl(fd->get(), F_SETFD, FD_CLOEXEC) != 0)
      throw ConfigError("gadget keep: is for `tagwrench run --output gadget`, which starts it");
  }
  run_gadget_daemon(given.face, std::move(link), std::move(watch), std::move(node), [given] {
    return open_gadget_node(GadgetFiles(), given.places, given.function);
  });
}

GadgetOutput::GadgetOutput(GadgetPort port) : port_(std::move(port)) {
  // By exec and not by fork alone: it allocates, and a thread of a library may hold malloc's lock.
  const UniqueFd watch = watch_nodes(port_.places.devices);
  int ends[2];
  if (::socketpair(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC | SOCK_NONBLOCK, 0, ends) != 0)
    no_daemon("cannot make a socket", std::strerror(errno));
  link_.reset(ends[0]);
  UniqueFd daemon_end(ends[1]);
  const int inherited[] = {daemon_end.get(), watch.get(), port_.node.fd.get()};
  const int error =
      spawn_daemon(daemon_, port_.program,
                   {"tagwrench", "gadget", "keep", "--face", std::string(face_name(port_.face)),
                    "--sysfs", port_.places.sysfs, "--devices", port_.places.devices, "--function",
                    port_.function, "--node", port_.node.path},
                   inherited, DaemonSignals::blocked);
  if (error != 0) no_daemon("cannot start its process", std::strerror(error));
  port_.node.fd.reset();
  daemon_end.reset();  // or its end would not be seen
  pollfd first{link_.get(), POLLIN, 0};
  uninterrupted([&] { return ::poll(&first, 1, kStart_ms); });
  GadgetEvent status_line{};
  const ssize_t got = ::recv(link_.get(), &status_line, sizeof status_line, MSG_DONTWAIT);
  if (got == sizeof status_line && status_line == GadgetEvent::ready) return;
  const char* why = got < 0 ? "it says nothing" : "it has ended";
  link_.reset();
  ::kill(daemon_, SIGKILL);
  uninterrupted([this] { return ::waitpid(daemon_, nullptr, 0); });
  no_daemon("its process does not begin", why);
}

GadgetOutput::~GadgetOutput() {
  if (daemon_ <= 0) return;
  const bool there = !lost_;
  ::shutdown(link_.get(), SHUT_WR);  // the watchdog's duplicate cannot keep it open
  pollfd gone{link_.get(), 0, 0};
  const auto wait = [&] { return ::poll(&gone, 1, kPatience_ms); };
  if (uninterrupted(wait) > 0) uninterrupted([this] { return ::waitpid(daemon_, nullptr, 0); });
  if (there) return;
  const OpenedNode node = open_gadget_node(GadgetFiles(), port_.places, port_.function);
  if (node.fd) rest_gadget(node.fd.get(), port_.face);
}

SendStatus GadgetOutput::put(std::span<const std::uint8_t> reports) noexcept {
  if (lost_) return SendStatus::failed;
  if (::send(link_.get(), reports.data(), reports.size(), MSG_DONTWAIT | MSG_NOSIGNAL) >= 0)
    return SendStatus::ok;
  if (errno == EAGAIN || errno == EINTR) return SendStatus::skipped;
  lost_ = true;
  return SendStatus::failed;
}

SendStatus GadgetOutput::send(const Sample& sample) noexcept {
  return port_.face == GadgetFace::wrench ? put(wrench_report(sample)) : SendStatus::ok;
}

SendStatus GadgetOutput::move(const Sample& sample) noexcept {
  if (port_.face != GadgetFace::spacemouse) return SendStatus::ok;
  auto [counts, pressed] = shown_motion(sample, kSpacemouseLimit_counts);
  if (port_.spnav_order) counts = to_spnav_order(counts);
  return put(packet(counts, pressed));
}

std::string GadgetOutput::failure() const {
  return "gadget: the process that writes to it (tw-gadget) has ended; start again";
}

std::string_view GadgetOutput::service() noexcept {
  std::array<std::uint8_t, 16> message;
  const ssize_t got = ::recv(link_.get(), message.data(), message.size(), MSG_DONTWAIT);
  lost_ = lost_ || got == 0;
  return got > 0 ? news_text(static_cast<GadgetEvent>(message[0])) : std::string_view();
}

void GadgetOutput::add_to(std::vector<WatchdogDevice>& devices) const {
  devices.push_back({link_.get(), {neutral(port_.face)}, {}});
}

}  // namespace tagwrench
