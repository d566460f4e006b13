// tagwrench-devices: makes one virtual device for whoever is connected to standard input, and
// passes its reports on until he goes (see device_service.h). systemd starts one for each
// connection, as a user who may open /dev/uhid and /dev/uinput.
#include <fcntl.h>
#include <poll.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <systemd/sd-login.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <csignal>
#include <string>
#include <vector>

#include "host/core/config_error.h"
#include "host/core/log.h"
#include "host/core/os/uninterrupted.h"
#include "host/output/device_service.h"
#include "host/output/hid_outputs.h"

namespace {

using namespace tagwrench;

constexpr int kClient = STDIN_FILENO;
constexpr int kFirstWord_ms = 10'000;  // who wants no device has none

/// Longer than any event, so that one that is too long is seen to be.
using Buffer = std::array<std::uint8_t, sizeof(uhid_event) + 1>;

// Not fuzzed: fuzz.device_requests has what judges the messages.

/// The next message of the client; empty: he has gone, sends nothing in time, or sends files, whose
/// closing might take for ever (and does not as this process ends).
std::span<const std::uint8_t> next_message(Buffer& buffer) {
  alignas(cmsghdr) std::array<std::uint8_t, CMSG_SPACE(253 * sizeof(int))> files;  // SCM_MAX_FD
  iovec place{buffer.data(), buffer.size()};
  msghdr message{nullptr, 0, &place, 1, files.data(), files.size(), 0};
  const ssize_t got = uninterrupted([&] { return ::recvmsg(kClient, &message, MSG_CMSG_CLOEXEC); });
  if (message.msg_controllen > 0) return {};
  return {buffer.data(), static_cast<std::size_t>(std::max<ssize_t>(got, 0))};
}

void answer(DeviceAnswer error) {
  [[maybe_unused]] const ssize_t sent = ::send(kClient, &error, sizeof error, MSG_NOSIGNAL);
}

/// Whoever sits at the computer, logged in and in front; members of the service's own group; root.
bool entitled() {
  ucred peer{};
  socklen_t size = sizeof peer;
  if (::getsockopt(kClient, SOL_SOCKET, SO_PEERCRED, &peer, &size) != 0) return false;
  const gid_t group = ::getegid();
  if (peer.uid == 0 || (group != 0 && peer.gid == group)) return true;
  if (::sd_uid_get_seats(peer.uid, /*require_active=*/1, nullptr) > 0) return true;
  std::vector<gid_t> groups(1024);
  size = static_cast<socklen_t>(groups.size() * sizeof groups[0]);
  if (group == 0 || ::getsockopt(kClient, SOL_SOCKET, SO_PEERGROUPS, groups.data(), &size) != 0)
    return false;
  groups.resize(size / sizeof groups[0]);
  return std::find(groups.begin(), groups.end(), group) != groups.end();
}

void lend_uhid(int node) {
  Buffer buffer;
  UhidGate gate;
  while (!gate.ended()) {
    std::array<pollfd, 2> ready{{{kClient, POLLIN, 0}, {node, POLLIN, 0}}};
    const int count = ::poll(ready.data(), ready.size(), gate.created() ? -1 : kFirstWord_ms);
    if (count == 0) return;
    if ((ready[1].revents & POLLIN) != 0) {  // of the kernel, for the client
      const ssize_t got = ::read(node, buffer.data(), buffer.size());
      if (got > 0)
        ::send(kClient, buffer.data(), static_cast<std::size_t>(got), MSG_DONTWAIT | MSG_NOSIGNAL);
    }
    if (ready[0].revents == 0) continue;
    const auto event = next_message(buffer);
    if (event.empty()) break;
    if (!gate.passes(event)) {
      log_info("refused: not a device of tagwrench, or not a report of it");
      break;
    }
    if (gate.ended()) break;  // at rest first; closing the node is the end
    uninterrupted([&] { return ::write(node, event.data(), event.size()); });
  }
  for (const std::vector<std::uint8_t>& report : gate.neutral())
    uninterrupted([&] { return ::write(node, report.data(), report.size()); });
}

void lend_uinput(int node) {
  Buffer buffer;
  pollfd ready{kClient, POLLIN, 0};
  if (::poll(&ready, 1, kFirstWord_ms) <= 0) return;
  const auto setup = lent_joystick(next_message(buffer));
  if (!setup) return answer(EPERM);
  const int error = make_joystick(node, *setup) ? 0 : errno;
  answer(error);
  if (error != 0) return;
  for (auto frame = next_message(buffer); is_joystick_frame(frame); frame = next_message(buffer))
    uninterrupted([&] { return ::write(node, frame.data(), frame.size()); });
  const JoystickEvents rest = joystick_events({}, 0);
  uninterrupted([&] { return ::write(node, rest.data(), sizeof rest); });
}

/// Which node the client wants, by the name of the socket that he connected to.
bool wants(const DeviceNode& node) {
  sockaddr_un address{};
  socklen_t size = sizeof address - 1;
  if (::getsockname(kClient, reinterpret_cast<sockaddr*>(&address), &size) != 0) return false;
  return std::string(address.sun_path).ends_with(std::string("/") + node.name);
}

}  // namespace

int main() {
  std::signal(SIGTERM, [](int) { ::shutdown(kClient, SHUT_RD); });  // the device comes to rest
  const bool uinput = wants(kUinputNode);
  if (!uinput && !wants(kUhidNode)) {
    log_info(
        "standard input is no connection of a socket named uhid or uinput; "
        "tagwrench-devices.socket starts this program");
    return 2;
  }
  if (!entitled()) {
    answer(EACCES);
    return 0;
  }
  // Waiting is for the client's messages; the node never keeps the others waiting.
  ::fcntl(kClient, F_SETFL, ::fcntl(kClient, F_GETFL) & ~O_NONBLOCK);
  const DeviceNode& wanted = uinput ? kUinputNode : kUhidNode;
  const UniqueFd node(::open(wanted.path().c_str(), O_RDWR | O_CLOEXEC | O_NONBLOCK));
  answer(node ? 0 : errno == EACCES ? EIO : errno);  // EACCES would mean the client's
  if (node) uinput ? lend_uinput(node.get()) : lend_uhid(node.get());
}
