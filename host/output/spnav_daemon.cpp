#include "host/output/spnav_daemon.h"

#include <fcntl.h>
#include <sys/epoll.h>
#include <sys/file.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <bit>
#include <cerrno>
#include <chrono>
#include <climits>
#include <cstdio>
#include <filesystem>
#include <limits>
#include <utility>

#include "host/core/config_error.h"
#include "host/core/os/user_folders.h"

// Not fuzzed: fuzz.spnav_requests has the dialogue and the messages.

namespace tagwrench {
namespace {

constexpr int kWaiting = 64;  // connections that were not accepted yet

std::string bridge_path(const std::string& path) { return path + ".bridge"; }

sockaddr_un address_of(const std::string& path) noexcept {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  path.copy(address.sun_path, sizeof address.sun_path - 1);
  return address;
}

UniqueFd connected(const std::string& path, int type) noexcept {
  UniqueFd fd(::socket(AF_UNIX, type | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
  const sockaddr_un address = address_of(path);
  if (fd && ::connect(fd.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0)
    return fd;
  const int error = errno;
  fd.reset();
  errno = error;
  return fd;
}

/// Whether somebody listens. A full queue or a refusal by permission is somebody too.
bool served(const std::string& path) noexcept {
  if (connected(path, SOCK_STREAM)) return true;
  return errno == EAGAIN || errno == EACCES || errno == EPERM;
}

[[noreturn]] void fail(const std::string& path, const char* what, int error) {
  throw ConfigError(
      "spnav socket {}: {}: {}; choose a path in a folder of yours, as in --output spnav:PATH",
      path, what, std::strerror(error));
}

/// Holds the folder while sockets come and go in it, so that two daemons do not take each other's.
UniqueFd lock_folder(const std::string& path) {
  const std::filesystem::path folder = std::filesystem::path(path).parent_path();
  UniqueFd fd(::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  if (!fd) fail(path, "its folder does not open", errno);
  while (::flock(fd.get(), LOCK_EX) != 0)
    if (errno != EINTR) fail(path, "its folder cannot be locked", errno);
  return fd;
}

/// Takes away what nobody serves: a socket, or a file without content, as is put there for Blender.
void remove_left_over(const std::string& path) {
  struct stat file {};
  if (::lstat(path.c_str(), &file) != 0) return;
  const bool worthless = S_ISSOCK(file.st_mode) || (S_ISREG(file.st_mode) && file.st_size == 0);
  if (!worthless) {
    throw ConfigError(
        "spnav socket {}: something else is there, not a socket; move it away or choose another "
        "path",
        path);
  }
  if (::unlink(path.c_str()) != 0) fail(path, "the left-over socket cannot be removed", errno);
}

UniqueFd listening(const std::string& path, int type, mode_t mode) {
  UniqueFd fd(::socket(AF_UNIX, type | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
  if (!fd) fail(path, "no socket to be had", errno);
  const sockaddr_un address = address_of(path);
  ::fchmod(fd.get(), mode);  // what the file will have, less the umask: at no time more than that
  if (::bind(fd.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0)
    fail(path, "cannot be made", errno);
  if (::chmod(path.c_str(), mode) != 0 || ::listen(fd.get(), kWaiting) != 0)
    fail(path, "cannot be served", errno);
  return fd;
}

ino_t file_number(const std::string& path) noexcept {
  struct stat file {};
  return ::lstat(path.c_str(), &file) == 0 ? file.st_ino : 0;
}

/// For root the place where all programs look, if no other server has it.
std::string default_path() {
  if (::geteuid() == 0 && (connect_spnav_bridge(kSpnavSystemSocket) || !served(kSpnavSystemSocket)))
    return kSpnavSystemSocket;
  return runtime_folder() + "/spnav.sock";
}

/// The kernel counts about 770 bytes a record, and doubles this.
constexpr int kSendBuffer_bytes = 8192;
constexpr int kRequestsAtOnce = 16;
/// libspnav speaks right after it has connected, and waits as long for the answer.
constexpr Duration kTimeToSpeak = std::chrono::milliseconds(300);

std::int32_t milliseconds_since(TimePoint then, TimePoint now) {
  const auto elapsed = std::chrono::duration_cast<std::chrono::milliseconds>(now - then).count();
  return static_cast<std::int32_t>(
      std::clamp<std::int64_t>(elapsed, 0, std::numeric_limits<std::int32_t>::max()));
}

using std::chrono::milliseconds;
using std::chrono::steady_clock;

constexpr int kUpdatesAtOnce = 16;
constexpr int kConnectionsAtOnce = 16;
constexpr std::uint32_t kMaxValid_ms = 1000;

SpnavPeer peer_of(int socket) noexcept {
  ucred credentials{};
  socklen_t size = sizeof credentials;
  SpnavPeer peer;
  if (::getsockopt(socket, SOL_SOCKET, SO_PEERCRED, &credentials, &size) != 0) return peer;
  peer.pid = credentials.pid;
  char path[32];
  std::snprintf(path, sizeof path, "/proc/%d/comm", peer.pid);
  const UniqueFd file(::open(path, O_RDONLY | O_CLOEXEC));
  const ssize_t got = file ? ::read(file.get(), peer.name.data(), peer.name.size() - 1) : 0;
  const auto end = peer.name.begin() + std::max<ssize_t>(got, 0);
  std::fill(std::find(peer.name.begin(), end, '\n'), peer.name.end(), '\0');
  return peer;
}

UniqueFd spare_descriptor() noexcept { return UniqueFd(::open("/dev/null", O_RDONLY | O_CLOEXEC)); }

/// One program that is connected to the spnav socket. Nothing queues for it: an event that it has
/// no room for is dropped, and when it has room again it gets the newest state. What it has been
/// told is remembered, so that no release, and no return to zero, is ever lost to it.
class SpnavClient {
 public:
  /// Makes the kernel's own queue short: about 20 events, a sixth of a second at 125 Hz; a program
  /// that draws that slowly loses no motion.
  SpnavClient(UniqueFd socket, const SpnavPeer& peer, bool device_present) noexcept
      : socket_(std::move(socket)),
        peer_(peer),
        device_told_(device_present),
        told_at_(std::chrono::steady_clock::now()),
        silent_until_(told_at_ + kTimeToSpeak) {
    ::setsockopt(socket_.get(), SOL_SOCKET, SO_SNDBUF, &kSendBuffer_bytes,
                 sizeof kSendBuffer_bytes);
  }

  /// Reads and answers requests, a bounded number of them. `device` is null while there is none.
  void read(const SpnavDevice* device, std::string_view path) noexcept {
    for (int i = 0; i < kRequestsAtOnce && rest_size_ == 0 && !gone_; ++i) {
      std::array<std::uint8_t, sizeof(SpnavRecord)> bytes;
      const ssize_t got = ::recv(socket_.get(), bytes.data(), dialogue_.wanted(), MSG_DONTWAIT);
      if (got < 0 && (errno == EAGAIN || errno == EINTR)) return;
      if (got <= 0) {
        gone_ = true;
        return;
      }
      answer(dialogue_.take(std::span(bytes).first(static_cast<std::size_t>(got)), device, path));
    }
  }

  /// Tells what has changed since it was told last; off-centre the motion too, if `moved`. Nothing
  /// before the program has said which version it speaks, or has not for a while: libspnav would
  /// take an event for the answer.
  void show(const SpnavState& state, const SpnavDevice* device, bool moved,
            TimePoint now) noexcept {
    if (behind_ || gone_ || now < silent_until_) return;
    const bool leaving = device == nullptr;
    const bool told = (leaving || show_device(device)) && show_buttons(state.buttons) &&
                      show_motion(state.motion, moved, now) && (!leaving || show_device(device));
    behind_ = !told;
  }

  /// After EPOLLOUT: sends the rest of what went half way, then what was missed.
  void resume(const SpnavState& state, const SpnavDevice* device, TimePoint now) noexcept {
    if (!flush() || !behind_) return;
    behind_ = false;
    show(state, device, true, now);
  }

  int fd() const noexcept { return socket_.get(); }
  const SpnavPeer& peer() const noexcept { return peer_; }
  /// What epoll is to wait for: EPOLLIN, or EPOLLOUT while it is slow; then its requests wait too.
  std::uint32_t interest() const noexcept {
    return behind_ || rest_size_ > 0 ? std::uint32_t{EPOLLOUT} : std::uint32_t{EPOLLIN};
  }

  std::uint32_t watched = 0;  ///< the interest that epoll knows of
  bool gone() const noexcept { return gone_; }
  void hang_up() noexcept { gone_ = true; }

 private:
  /// All of it, or nothing: what the kernel took in part goes on its way later.
  bool put(const SpnavRecord& record) noexcept {
    if (rest_size_ > 0 || gone_) return false;
    const ssize_t sent =
        ::send(socket_.get(), record.data(), sizeof record, MSG_DONTWAIT | MSG_NOSIGNAL);
    if (sent < 0) {
      gone_ = errno != EAGAIN && errno != EINTR;
      return false;
    }
    const auto bytes = std::bit_cast<std::array<std::uint8_t, sizeof record>>(record);
    rest_size_ = sizeof record - static_cast<std::size_t>(sent);
    std::copy(bytes.begin() + sent, bytes.end(), rest_.begin());
    return true;
  }

  /// True when nothing is under way.
  bool flush() noexcept {
    while (rest_size_ > 0 && !gone_) {
      const ssize_t sent =
          ::send(socket_.get(), rest_.data(), rest_size_, MSG_DONTWAIT | MSG_NOSIGNAL);
      if (sent < 0 && errno == EINTR) continue;
      if (sent < 0 && errno == EAGAIN) return false;
      if (sent < 0) {
        gone_ = true;
        return false;
      }
      rest_size_ -= static_cast<std::size_t>(sent);
      std::copy_n(rest_.begin() + sent, rest_size_, rest_.begin());
    }
    return !gone_;
  }

  void answer(std::span<const std::uint8_t> bytes) noexcept {
    if (dialogue_.has_spoken()) silent_until_ = TimePoint::min();
    rest_size_ = bytes.size();
    std::copy(bytes.begin(), bytes.end(), rest_.begin());
    flush();
  }

  bool show_buttons(std::uint32_t buttons) noexcept {
    for (int i = 0; i < kSpnavButtons; ++i) {
      const std::uint32_t bit = std::uint32_t{1} << i;
      if (((buttons ^ told_.buttons) & bit) == 0) continue;
      const bool pressed = (buttons & bit) != 0;
      if (dialogue_.wants(SpnavDialogue::kButton) && !put(spnav_button(i, pressed))) return false;
      told_.buttons ^= bit;
    }
    return true;
  }

  bool show_motion(const Counts6& motion, bool moved, TimePoint now) noexcept {
    const bool off_centre = motion != Counts6{};
    const bool event = off_centre ? moved || motion != told_.motion : told_.off_centre();
    if (!event || !dialogue_.wants(SpnavDialogue::kMotion)) return true;
    if (!put(spnav_motion(motion, dialogue_.sensitivity(), milliseconds_since(told_at_, now))))
      return false;
    told_.motion = motion;
    told_at_ = now;
    return true;
  }

  bool show_device(const SpnavDevice* device) noexcept {
    const bool present = device != nullptr;
    if (present == device_told_) {
      if (present) told_device_ = *device;
      return true;
    }
    const SpnavDevice& about = present ? *device : told_device_;
    if (dialogue_.wants(SpnavDialogue::kDevice) && !put(spnav_device(present, about))) return false;
    device_told_ = present;
    told_device_ = about;
    return true;
  }

  UniqueFd socket_;
  SpnavPeer peer_;
  SpnavDialogue dialogue_;
  SpnavState told_;
  SpnavDevice told_device_;
  bool device_told_;
  TimePoint told_at_;       ///< of the last motion
  TimePoint silent_until_;  ///< unless it speaks before
  bool behind_ = false;     ///< an event was dropped since the last room
  bool gone_ = false;
  std::array<std::uint8_t, SpnavDialogue::kMaxAnswers * sizeof(SpnavRecord)> rest_{};
  std::size_t rest_size_ = 0;  ///< bytes of rest_: the end of a record or answer that is under way
};

class SpnavDaemon {
 public:
  SpnavDaemon(SpnavSockets sockets, const SpnavDaemonOptions& options, int stop_fd)
      : sockets_(std::move(sockets)),
        options_(options),
        stop_fd_(stop_fd),
        epoll_(::epoll_create1(EPOLL_CLOEXEC)),
        idle_since_(steady_clock::now()),
        spare_(spare_descriptor()) {
    if (!epoll_)
      throw ConfigError("spnav socket " + sockets_.path +
                        ": no epoll to be had; end other programs");
    clients_.reserve(options_.most_programs);
    watch(sockets_.programs.get(), &sockets_.programs, EPOLLIN, EPOLL_CTL_ADD);
    watch(sockets_.bridge.get(), &sockets_.bridge, EPOLLIN, EPOLL_CTL_ADD);
    if (stop_fd_ >= 0) watch(stop_fd_, &stop_fd_, EPOLLIN, EPOLL_CTL_ADD);
  }

  /// Leaves programs at rest and takes the sockets away.
  ~SpnavDaemon() {
    sockets_.remove();
    lose_bridge();
  }

  void run() noexcept {
    std::array<epoll_event, 32> events;
    while (!stopped_) {
      const int count =
          ::epoll_wait(epoll_.get(), events.data(), static_cast<int>(events.size()), patience_ms());
      for (int i = 0; i < count; ++i) handle(events[static_cast<std::size_t>(i)]);
      check_time();
      sweep();
    }
  }

 private:
  void handle(const epoll_event& event) noexcept {
    const void* about = event.data.ptr;
    if (about == &stop_fd_) {
      stopped_ = true;
    } else if (about == &sockets_.programs) {
      accept_programs();
    } else if (about == &sockets_.bridge) {
      accept_bridge();
    } else if (about == &bridge_) {
      read_bridge();
    } else {
      auto& client = *static_cast<SpnavClient*>(event.data.ptr);
      if ((event.events & (EPOLLHUP | EPOLLERR)) != 0)
        client.hang_up();
      else if ((event.events & EPOLLOUT) != 0)
        client.resume(state_, device(), steady_clock::now());
      else
        client.read(device(), sockets_.path);
    }
  }

  void accept_programs() noexcept {
    for (int i = 0; i < kConnectionsAtOnce; ++i) {
      UniqueFd socket(::accept4(sockets_.programs.get(), nullptr, nullptr, SOCK_CLOEXEC));
      if (!socket && (errno == EMFILE || errno == ENFILE)) turn_away();
      if (!socket) return;
      if (clients_.size() < options_.most_programs) add_program(std::move(socket));
    }
  }

  void add_program(UniqueFd socket) noexcept {
    const SpnavPeer peer = peer_of(socket.get());
    auto client = std::make_unique<SpnavClient>(std::move(socket), peer, device_.has_value());
    client->watched = client->interest();
    watch(client->fd(), client.get(), client->watched, EPOLL_CTL_ADD);
    tell_bridge(*client, true);
    clients_.push_back(std::move(client));  // within what was reserved
  }

  /// One at a time; another one is told who has the place.
  void accept_bridge() noexcept {
    UniqueFd socket(::accept4(sockets_.bridge.get(), nullptr, nullptr, SOCK_CLOEXEC));
    if (!socket) return;
    SpnavGreeting greeting;
    greeting.daemon_pid = ::getpid();
    greeting.refused = bridge_ ? 1 : 0;
    greeting.other_bridge = bridge_ ? bridge_pid_ : 0;
    if (!send_spnav(socket.get(), greeting) || bridge_) return;
    bridge_pid_ = peer_of(socket.get()).pid;
    bridge_ = std::move(socket);
    watch(bridge_.get(), &bridge_, EPOLLIN, EPOLL_CTL_ADD);
    for (const auto& client : clients_) tell_bridge(*client, true);
  }

  void read_bridge() noexcept {
    std::array<std::uint8_t, kSpnavLongestMessage> buffer;
    for (int i = 0; i < kUpdatesAtOnce && bridge_; ++i) {
      const SpnavReceived received = receive_spnav(bridge_.get(), buffer);
      if (received.open && received.bytes.empty()) return;
      if (!received.open || !take(received.bytes)) lose_bridge();
    }
  }

  /// False: nothing that a bridge says.
  bool take(std::span<const std::uint8_t> message) noexcept {
    if (const auto hello = spnav_message<SpnavHello>(message)) {
      device_ = hello->device;
      device_->name.back() = '\0';
      show(false);
      return true;
    }
    const auto update = spnav_message<SpnavUpdate>(message);
    if (!update || !device_) return false;
    state_ = update->state;
    const bool rest = state_ == SpnavState{};
    const milliseconds valid(std::min(update->valid_ms, kMaxValid_ms));
    valid_until_ = rest ? TimePoint::max() : steady_clock::now() + valid;
    show(true);
    return true;
  }

  void lose_bridge() noexcept {
    if (bridge_) watch(bridge_.get(), nullptr, 0, EPOLL_CTL_DEL);
    bridge_.reset();
    device_.reset();
    state_ = {};
    valid_until_ = TimePoint::max();
    show(false);
  }

  void show(bool moved) noexcept {
    const TimePoint now = steady_clock::now();
    for (const auto& client : clients_) client->show(state_, device(), moved, now);
  }

  /// What epoll waits for follows what the programs are good for; those that are gone go.
  void sweep() noexcept {
    for (const auto& client : clients_) {
      if (client->gone()) {
        tell_bridge(*client, false);
        watch(client->fd(), nullptr, 0, EPOLL_CTL_DEL);
      } else if (client->watched != client->interest()) {
        client->watched = client->interest();
        watch(client->fd(), client.get(), client->watched, EPOLL_CTL_MOD);
      }
    }
    std::erase_if(clients_, [](const auto& client) { return client->gone(); });
  }

  /// Without a descriptor for it; else its connection would wake the loop for ever.
  void turn_away() noexcept {
    spare_.reset();
    UniqueFd(::accept4(sockets_.programs.get(), nullptr, nullptr, SOCK_CLOEXEC)).reset();
    spare_ = spare_descriptor();
  }

  void watch(int fd, void* about, std::uint32_t events, int operation) noexcept {
    epoll_event event{};
    event.events = events;
    event.data.ptr = about;
    ::epoll_ctl(epoll_.get(), operation, fd, &event);
  }

  void tell_bridge(const SpnavClient& client, bool connected) noexcept {
    if (!bridge_) return;
    SpnavProgram program;
    program.connected = connected ? 1 : 0;
    program.peer = client.peer();
    send_spnav(bridge_.get(), program);  // unsaid if there is no room: it is status_line for people
  }

  const SpnavDevice* device() const noexcept { return device_ ? &*device_ : nullptr; }
  int patience_ms() const noexcept {
    TimePoint until = valid_until_;
    if (options_.idle_end && !bridge_ && clients_.empty())
      until = std::min(until, idle_since_ + *options_.idle_end);
    if (until == TimePoint::max()) return -1;
    const auto left = std::chrono::ceil<milliseconds>(until - steady_clock::now()).count();
    return static_cast<int>(std::clamp<std::int64_t>(left, 0, INT_MAX));
  }

  void check_time() noexcept {
    const TimePoint now = steady_clock::now();
    if (now >= valid_until_) {
      valid_until_ = TimePoint::max();
      state_ = {};
      show(false);
    }
    if (bridge_ || !clients_.empty()) idle_since_ = now;
    if (options_.idle_end && now >= idle_since_ + *options_.idle_end) stopped_ = true;
  }

  SpnavSockets sockets_;
  SpnavDaemonOptions options_;
  int stop_fd_;
  UniqueFd epoll_;
  UniqueFd bridge_;
  std::int32_t bridge_pid_ = 0;
  std::optional<SpnavDevice> device_;  ///< what the bridge said that it is
  SpnavState state_;
  TimePoint valid_until_ = TimePoint::max();  ///< of state_
  TimePoint idle_since_;
  std::vector<std::unique_ptr<SpnavClient>> clients_;
  UniqueFd spare_;  ///< given up to turn away who comes when no descriptor is left
  bool stopped_ = false;
};

}  // namespace

SpnavReceived receive_spnav(int link, std::span<std::uint8_t> buffer) noexcept {
  const ssize_t got = ::recv(link, buffer.data(), buffer.size(), MSG_DONTWAIT);
  if (got > 0) return {buffer.first(static_cast<std::size_t>(got)), true};
  return {{}, got < 0 && (errno == EAGAIN || errno == EINTR)};
}

bool send_spnav_bytes(int link, std::span<const std::uint8_t> bytes) noexcept {
  return ::send(link, bytes.data(), bytes.size(), MSG_DONTWAIT | MSG_NOSIGNAL) ==
         static_cast<ssize_t>(bytes.size());
}

std::string spnav_socket_path(const std::string& given) {
  const std::string path =
      given.empty() ? default_path() : std::filesystem::absolute(given).lexically_normal().string();
  if (bridge_path(path).size() >= sizeof sockaddr_un::sun_path) {
    throw ConfigError("spnav socket {}: longer than {} bytes; choose a shorter path", path,
                      sizeof sockaddr_un::sun_path - 1 - 7);
  }
  return path;
}

std::optional<SpnavSockets> listen_spnav(const std::string& path) {
  const UniqueFd lock = lock_folder(path);
  if (connect_spnav_bridge(path)) return {};
  if (served(path)) {
    throw ConfigError(
        "spnav socket {}: another server has it, spacenavd perhaps; end it, or choose another "
        "path, as in --output spnav:PATH",
        path);
  }
  remove_left_over(path);
  remove_left_over(bridge_path(path));
  SpnavSockets sockets;
  sockets.path = path;
  sockets.bridge = listening(bridge_path(path), SOCK_SEQPACKET, 0600);
  sockets.programs = listening(path, SOCK_STREAM, path == kSpnavSystemSocket ? 0666 : 0600);
  sockets.programs_file = file_number(path);
  sockets.bridge_file = file_number(bridge_path(path));
  return sockets;
}

SpnavSockets inherited_spnav(const std::string& path, int programs, int bridge) {
  SpnavSockets sockets;
  sockets.path = path;
  sockets.programs.reset(programs);
  sockets.bridge.reset(bridge);
  for (const int fd : {programs, bridge}) {
    int is_listening = 0;
    socklen_t size = sizeof is_listening;
    if (::getsockopt(fd, SOL_SOCKET, SO_ACCEPTCONN, &is_listening, &size) != 0 || is_listening == 0)
      throw ConfigError("spnav socket {}: {} is no listening socket", path, fd);
    ::fcntl(fd, F_SETFD, FD_CLOEXEC);
    ::fcntl(fd, F_SETFL, O_NONBLOCK);
    ::listen(fd, kWaiting);  // again, by us: whoever connects learns who is here now
  }
  sockets.programs_file = file_number(path);
  sockets.bridge_file = file_number(bridge_path(path));
  return sockets;
}

void SpnavSockets::remove() const noexcept {
  if (file_number(path) == programs_file) ::unlink(path.c_str());
  const std::string beside = bridge_path(path);
  if (file_number(beside) == bridge_file) ::unlink(beside.c_str());
}

UniqueFd connect_spnav_bridge(const std::string& path) noexcept {
  return connected(bridge_path(path), SOCK_SEQPACKET);
}

void run_spnav_daemon(SpnavSockets sockets, const SpnavDaemonOptions& options, int stop_fd) {
  SpnavDaemon(std::move(sockets), options, stop_fd).run();
}

}  // namespace tagwrench
