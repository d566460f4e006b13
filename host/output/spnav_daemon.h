// The process that holds the spnav socket: one thread, one epoll loop, many programs, one bridge.
#pragma once

#include <sys/epoll.h>

#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "host/core/os/unique_fd.h"
#include "host/core/types.h"
#include "host/output/spnav_client.h"
#include "host/output/spnav_link.h"

namespace tagwrench {

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
