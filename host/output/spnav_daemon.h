// What the daemon of the spnav socket and the bridge say to each other, and the sockets of both.
//
// The socket that programs connect to is held by a small process of its own, the daemon, so that
// they stay connected while the bridge restarts: FreeCAD spins at 100 % CPU when its server ends,
// and neither it nor Blender connects again. Beside PATH lies PATH.bridge, a SOCK_SEQPACKET socket
// for one bridge, its owner's alone. Whoever connects there is told at once whether it is welcome,
// says what the device is, and from then on what it shows. Numbers are in host byte order; all
// messages are of fixed size and start with what they are.
#pragma once

#include <array>
#include <cstdint>
#include <cstring>
#include <optional>
#include <span>
#include <string>
#include <type_traits>

#include "host/core/os/unique_fd.h"
#include "host/core/types.h"
#include "host/output/spnav_protocol.h"

namespace tagwrench {

/// The last byte is the version: a daemon may be older than the bridge.
enum class SpnavWord : std::uint32_t {
  greeting = 0x74776701,
  hello = 0x74776801,
  update = 0x74777501,
  program = 0x74777001,
};

/// Daemon to bridge, first of all.
struct SpnavGreeting {
  static constexpr SpnavWord kWord = SpnavWord::greeting;
  SpnavWord word = kWord;
  std::int32_t daemon_pid = 0;
  std::uint32_t refused = 0;      ///< another bridge feeds it already:
  std::int32_t other_bridge = 0;  ///< this one; 0 if unknown
};

/// Bridge to daemon: what the device is.
struct SpnavHello {
  static constexpr SpnavWord kWord = SpnavWord::hello;
  SpnavWord word = kWord;
  SpnavDevice device;
};

/// Bridge to daemon: what it shows. Off-centre or with a button pressed it must come again in time.
struct SpnavUpdate {
  static constexpr SpnavWord kWord = SpnavWord::update;
  SpnavWord word = kWord;
  SpnavState state;
  std::uint32_t valid_ms = 0;  ///< without another one by then all is neutral
};

/// Who is at the other end of a socket.
struct SpnavPeer {
  std::int32_t pid = 0;         ///< 0: unknown
  std::array<char, 16> name{};  ///< as the kernel has it, "freecad" say; ends with a zero
};

/// Daemon to bridge: a program has connected, or has gone.
struct SpnavProgram {
  static constexpr SpnavWord kWord = SpnavWord::program;
  SpnavWord word = kWord;
  std::uint32_t connected = 0;
  SpnavPeer peer;
};

constexpr std::size_t kSpnavLongestMessage = 128;

template <typename Message>
std::optional<Message> spnav_message(std::span<const std::uint8_t> bytes) noexcept {
  static_assert(std::is_trivially_copyable_v<Message> && sizeof(Message) <= kSpnavLongestMessage);
  if (bytes.size() != sizeof(Message)) return {};
  Message message;
  std::memcpy(&message, bytes.data(), sizeof message);
  if (message.word != Message::kWord) return {};
  return message;
}

/// Of recv() on a link: the bytes; empty: nothing yet, or, not `open`, the other side has gone.
struct SpnavReceived {
  std::span<const std::uint8_t> bytes;
  bool open = true;
};
SpnavReceived receive_spnav(int link, std::span<std::uint8_t> buffer) noexcept;

/// False: no room, or gone; `errno` tells. Never blocks.
bool send_spnav_bytes(int link, std::span<const std::uint8_t> bytes) noexcept;

template <typename Message>
bool send_spnav(int link, const Message& message) noexcept {
  static_assert(std::is_trivially_copyable_v<Message>);
  return send_spnav_bytes(link, {reinterpret_cast<const std::uint8_t*>(&message), sizeof message});
}

/// Where libspnav looks if nothing else is said.
inline constexpr const char* kSpnavSystemSocket = "/var/run/spnav.sock";

/// `given` as an absolute path; where it is empty spnav.sock in runtime_folder(), or, for root,
/// libspnav's own place if no other server has it. Throws ConfigError: no place, path too long.
std::string spnav_socket_path(const std::string& given);

/// The two sockets of a daemon, listening. remove() removes their files, if they are still ours.
struct SpnavSockets {
  std::string path;
  UniqueFd programs;
  UniqueFd bridge;
  ino_t programs_file = 0;
  ino_t bridge_file = 0;

  void remove() const noexcept;
};

/// Makes them: for their owner alone, at libspnav's own path for everybody. A left-over of a daemon
/// that was killed is replaced. Nothing if a daemon serves the path already. Throws ConfigError: no
/// such folder, no permission, another server or a file is there.
std::optional<SpnavSockets> listen_spnav(const std::string& path);

/// Those that were inherited as descriptors.
SpnavSockets inherited_spnav(const std::string& path, int programs, int bridge);

/// Connects to the daemon; -1 if there is none.
UniqueFd connect_spnav_bridge(const std::string& path) noexcept;

// The process that holds the spnav socket: one thread, one epoll loop, many programs, one bridge.

struct SpnavDaemonOptions {
  std::optional<Duration> idle_end;  ///< ends after so long without bridge and programs
  std::size_t most_programs = 128;   ///< further ones are turned away: accepted and closed
};

/// Programs get what the bridge shows: an event for every update off-centre, one for the return to
/// zero, none at rest. When the bridge goes, or falls silent for longer than it said it would, they
/// get zero and the release of every button, and stay connected.
///
/// Runs until `stop_fd` is readable (-1: never) or it has been idle for long; leaves programs at
/// rest and takes the sockets away. Throws ConfigError if the kernel has no epoll to give.
void run_spnav_daemon(SpnavSockets sockets, const SpnavDaemonOptions& options, int stop_fd);

}  // namespace tagwrench
