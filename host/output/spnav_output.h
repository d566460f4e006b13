// The spnav socket without spacenavd and without a kernel device: for machines that have no uhid,
// sandboxes and remote desktops. It is held by a daemon process (spnav_daemon.h), which this starts
// if there is none, and which stays when the bridge ends.
#pragma once

#include <sys/types.h>

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "host/core/os/unique_fd.h"
#include "host/output/output.h"
#include "host/output/spnav_daemon.h"

namespace tagwrench {

struct SpnavOptions {
  std::string socket;  ///< path; empty: the usual one
  /// What programs are told that the device is.
  std::uint16_t vendor = 0x256f;
  std::uint16_t product = 0xc62e;
  std::string name = "tagwrench SpaceMouse";
  /// Program whose verb `spnav` is the daemon.
  std::string program = "/proc/self/exe";
};

/// Sends Sample::deflection as +-500 counts in spnav's axes: an event for every move off-centre,
/// one for the return to zero, none at rest. FreeCAD turns by counts times events, so moves at a
/// steady rate make its speed. Should the bridge hang or die, the daemon goes neutral 45 ms after
/// the move that should have come. Should the daemon die, another one is started; programs do not
/// connect to it by themselves.
class SpnavOutput : public Output {
 public:
  /// Throws ConfigError: no place for the socket, another server has it, another bridge feeds its
  /// daemon, the daemon cannot be started or is stopped (SIGSTOP).
  explicit SpnavOutput(const SpnavOptions& options);
  ~SpnavOutput() override;

  SendStatus move(const Sample& sample) noexcept override;
  std::string failure() const override;
  int poll_fd() const noexcept override { return link_.get(); }
  /// Programs that come and go, and the daemon's end.
  std::string_view service() noexcept override;

  /// Where programs connect, as an absolute path.
  const std::string& socket() const noexcept { return path_; }
  /// How programs find it, for people.
  std::string advice() const;
  /// Who is connected now, in the order of their coming.
  const std::vector<SpnavPeer>& programs() const noexcept { return programs_; }

 private:
  bool reach_daemon();
  void start_daemon(const SpnavSockets& sockets);
  void await_greeting();
  std::string_view lost_daemon() noexcept;
  std::string_view take(const SpnavProgram& program) noexcept;
  std::uint32_t valid_ms(TimePoint now) noexcept;

  SpnavOptions options_;
  std::string path_;
  UniqueFd link_;
  bool welcome_ = false;  ///< the daemon takes what is sent
  std::optional<std::int32_t> other_bridge_;
  pid_t daemon_ = 0;  ///< if it is a child of ours
  SpnavState last_;   ///< what the daemon has
  TimePoint last_move_{};
  std::array<Duration, 3> intervals_;  ///< the last three between moves
  TimePoint next_attempt_{};
  std::vector<SpnavPeer> programs_;
  std::array<char, 256> status_line_{};  ///< the last that service() said
};

}  // namespace tagwrench
