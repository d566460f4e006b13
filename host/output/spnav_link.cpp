#include "host/output/spnav_link.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <filesystem>

#include "host/core/config_error.h"
#include "host/core/os/runtime_folder.h"

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
  throw ConfigError(fmt::format(
      "spnav socket {}: {}: {}; choose a path in a folder of yours, as in --output spnav:PATH",
      path, what, std::strerror(error)));
}

/// Holds the folder while sockets come and go in it, so that two daemons do not take each other's.
UniqueFd lock_folder(const std::string& path) {
  const std::filesystem::path folder = std::filesystem::path(path).parent_path();
  UniqueFd fd(::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  if (!fd) fail(path, "its folder does not open", errno);
  while (::flock(fd.get(), LOCK_EX) != 0) {
    if (errno != EINTR) fail(path, "its folder cannot be locked", errno);
  }
  return fd;
}

/// Takes away what nobody serves: a socket, or a file without content, as is put there for Blender.
void remove_left_over(const std::string& path) {
  struct stat file {};
  if (::lstat(path.c_str(), &file) != 0) return;
  const bool worthless = S_ISSOCK(file.st_mode) || (S_ISREG(file.st_mode) && file.st_size == 0);
  if (!worthless) {
    throw ConfigError(
        fmt::format("spnav socket {}: something else is there, not a socket; move it away or "
                    "choose another path",
                    path));
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
    throw ConfigError(fmt::format("spnav socket {}: longer than {} bytes; choose a shorter path",
                                  path, sizeof sockaddr_un::sun_path - 1 - 7));
  }
  return path;
}

std::optional<SpnavSockets> listen_spnav(const std::string& path) {
  const UniqueFd lock = lock_folder(path);
  if (connect_spnav_bridge(path)) return {};
  if (served(path)) {
    throw ConfigError(
        fmt::format("spnav socket {}: another server has it, spacenavd perhaps; end it, or choose "
                    "another path, "
                    "as in --output spnav:PATH",
                    path));
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
      throw ConfigError(fmt::format("spnav socket {}: {} is no listening socket", path, fd));
    ::fcntl(fd, F_SETFD, FD_CLOEXEC);
    ::fcntl(fd, F_SETFL, O_NONBLOCK);
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

}  // namespace tagwrench
