// Neutral even when the bridge cannot say so: its loop hangs, it is stopped (SIGSTOP, a debugger),
// or it is killed.
//
// A watchdog PROCESS holds duplicates of the devices' file descriptors. It sleeps until the
// deadline that the bridge keeps pushing ahead in a shared page. When a deadline passes, it writes
// each device's neutral report, once. When the bridge is gone, it writes neutral, destroys the
// devices, and exits.
//
// Why a process and not a thread: SIGSTOP, a core dump and SIGKILL take all threads of a process at
// once, and after SIGKILL nobody could send the last neutral report. The kernel does remove the
// devices of a dead process, but tells evdev readers of no return to zero, and a client such as
// spacenavd then keeps its last motion.
#pragma once

#include <sys/types.h>

#include <cstdint>
#include <memory>
#include <string_view>
#include <vector>

#include "host/core/os/unique_fd.h"
#include "host/core/types.h"
#include "host/output/output.h"

namespace tagwrench {

/// A device that is brought to rest by writing bytes. The fd is borrowed until the Watchdog exists.
struct WatchdogDevice {
  int fd = -1;
  std::vector<std::vector<std::uint8_t>> neutral;  ///< a write each
  std::vector<std::uint8_t> destroy;  ///< may be empty: the last close() then removes the device
};

/// Construct it after the outputs; destroy it before the outputs. Other threads may run, as
/// libraries start them: _Fork() calls no handlers of theirs, and the watchdog makes
/// async-signal-safe calls only, so that no lock which such a thread held at the fork is ever
/// taken. (A program of its own would load the same libraries, and have their threads in the
/// watchdog.) A camera may be open: the watchdog keeps no other file open, and capture buffers are
/// mapped MADV_DONTFORK. It leaves the terminal's session, so Ctrl-C and Ctrl-Z reach the bridge
/// alone; its name is "tw-watchdog", so that a kill by the bridge's name spares it.
class Watchdog {
 public:
  /// Without devices nothing is started. Throws ConfigError: no process or memory to be had.
  explicit Watchdog(const std::vector<WatchdogDevice>& devices);
  Watchdog(const Watchdog&) = delete;
  Watchdog& operator=(const Watchdog&) = delete;
  /// Dismisses the watchdog without touching the devices, and waits for it to go.
  ~Watchdog();

  /// Expects the next call by `deadline`; else all devices go neutral. One store; a system call
  /// only after stand_down(), after a missed deadline, or if the deadline moves back.
  void expect_by(TimePoint deadline) noexcept;

  /// Expects nothing: the watchdog sleeps until the next expect_by() or the bridge's end.
  void stand_down() noexcept;

  /// The watchdog's process id, 0 if there is none.
  pid_t pid() const noexcept { return watchdog_; }

 private:
  struct Shared;

  Shared* shared_ = nullptr;  ///< one page, MAP_SHARED with the watchdog
  UniqueFd link_;  ///< wakes the watchdog; its closing, by whatever end of the bridge, is the death
                   ///< notice
  pid_t watchdog_ = 0;
};

// What systemd is told by a service that it supervises (sd_notify(3)): that it is ready, what it is
// doing, and that its loop still turns.

class ServiceWatch final : public Output {
 public:
  /// Nothing where no systemd supervises this process.
  static std::unique_ptr<ServiceWatch> open();
  /// Says that the service is about to end.
  ~ServiceWatch() override;

  /// Set up, or waiting for what may come at any time; `status` says which.
  void ready(std::string_view status) noexcept;

  /// Readable when systemd wants a sign of life; -1 if it does not.
  int poll_fd() const noexcept override { return timer_.get(); }
  /// The sign of life. Whoever polls calls it, so that a loop that hangs gives none.
  std::string_view service() noexcept override;

  /// The last line for people is the state that `systemctl status` shows.
  bool notice(std::string_view line) noexcept override;

 private:
  explicit ServiceWatch(UniqueFd timer) noexcept : timer_(std::move(timer)) {}

  UniqueFd timer_;
};

}  // namespace tagwrench
