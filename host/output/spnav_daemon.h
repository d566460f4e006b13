// The process that holds the spnav socket: one thread, one epoll loop, many programs, one bridge.
#pragma once

#include <sys/epoll.h>

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "host/core/os/unique_fd.h"
#include "host/core/types.h"
#include "host/output/spnav_link.h"
#include "host/output/spnav_protocol.h"

namespace tagwrench {

// One program that is connected to the spnav socket. Nothing queues for it: an event that it has no
// room for is dropped, and when it has room again it gets the newest state. What it has been told
// is remembered, so that no release, and no return to zero, is ever lost to it.

class SpnavClient {
 public:
  /// Makes the kernel's own queue short: about 20 events, a sixth of a second at 125 Hz; a program
  /// that draws that slowly loses no motion.
  SpnavClient(UniqueFd socket, const SpnavPeer& peer, bool device_present) noexcept;

  /// Reads and answers requests, a bounded number of them. `device` is null while there is none.
  void read(const SpnavDevice* device, std::string_view path) noexcept;

  /// Tells what has changed since it was told last; off-centre the motion too, if `moved`. Nothing
  /// before the program has said which version it speaks, or has not for a while: libspnav would
  /// take an event for the answer.
  void show(const SpnavState& state, const SpnavDevice* device, bool moved, TimePoint now) noexcept;

  /// After EPOLLOUT: sends the rest of what went half way, then what was missed.
  void resume(const SpnavState& state, const SpnavDevice* device, TimePoint now) noexcept;

  int fd() const noexcept { return socket_.get(); }
  const SpnavPeer& peer() const noexcept { return peer_; }
  /// What epoll is to wait for: EPOLLIN, or EPOLLOUT while it is slow; then its requests wait too.
  std::uint32_t interest() const noexcept;
  std::uint32_t watched = 0;  ///< the interest that epoll knows of
  bool gone() const noexcept { return gone_; }
  void hang_up() noexcept { gone_ = true; }

 private:
  bool put(const SpnavRecord& record) noexcept;
  bool flush() noexcept;
  void answer(std::span<const std::uint8_t> bytes) noexcept;
  bool show_buttons(std::uint32_t buttons) noexcept;
  bool show_motion(const Counts6& motion, bool moved, TimePoint now) noexcept;
  bool show_device(const SpnavDevice* device) noexcept;

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

struct SpnavDaemonOptions {
  std::optional<Duration> idle_end;  ///< ends after so long without bridge and programs
  std::size_t most_programs = 128;   ///< further ones are turned away: accepted and closed
};

/// Programs get what the bridge shows: an event for every update off-centre, one for the return to
/// zero, none at rest. When the bridge goes, or falls silent for longer than it said it would, they
/// get zero and the release of every button, and stay connected.
class SpnavDaemon {
 public:
  /// `stop_fd` becomes readable when the daemon shall end; -1: never. Throws ConfigError if the
  /// kernel has no epoll to give.
  SpnavDaemon(SpnavSockets sockets, const SpnavDaemonOptions& options, int stop_fd);
  SpnavDaemon(const SpnavDaemon&) = delete;
  SpnavDaemon& operator=(const SpnavDaemon&) = delete;
  /// Leaves programs at rest and takes the sockets away.
  ~SpnavDaemon();

  void run() noexcept;

 private:
  void handle(const epoll_event& event) noexcept;
  void accept_programs() noexcept;
  void add_program(UniqueFd socket) noexcept;
  void accept_bridge() noexcept;
  void read_bridge() noexcept;
  bool take(std::span<const std::uint8_t> message) noexcept;
  void lose_bridge() noexcept;
  void show(bool moved) noexcept;
  void sweep() noexcept;
  void turn_away() noexcept;
  void watch(int fd, void* about, std::uint32_t events, int operation) noexcept;
  void tell_bridge(const SpnavClient& client, bool connected) noexcept;
  const SpnavDevice* device() const noexcept { return device_ ? &*device_ : nullptr; }
  int patience_ms() const noexcept;
  void check_time() noexcept;

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

}  // namespace tagwrench
