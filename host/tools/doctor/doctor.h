// Room tools/doctor: what of this machine is ready.
// In:  device nodes, groups, udev rules, cameras, serial ports, sockets of CAD programs.
// Out: a line each: ok, not needed, or missing with what to do.
#pragma once

#include <fmt/format.h>

#include <array>
#include <cstdint>
#include <filesystem>
#include <iosfwd>
#include <optional>
#include <ostream>
#include <string>
#include <string_view>
#include <vector>

#include "host/core/printable.h"

namespace tagwrench {

/// Writes one line a finding: "ok" works, "--" is not there and not needed, "!!" is missing, with
/// the remedy behind it. Returns 0 when everything that a virtual device needs is in place
/// (/dev/uhid and /dev/uinput, or the service that stands for them), else 1: the simulated sensor
/// stands in for a camera.
int run_doctor(std::ostream& out);

/// An input device that clients of spacenavd take for a 6-DOF one.
struct InputDevice {
  std::string name;
  unsigned vendor = 0;
  unsigned product = 0;
};

/// Those in the text of /proc/bus/input/devices that are 6-DOF devices (vendor 256f, a SpaceMouse
/// of vendor 046d, or "3Dconnexion" in the name) and not ours ("tagwrench" in the name).
std::vector<InputDevice> other_6dof_devices(std::string_view text);

// One line a finding.

enum class Mark : std::uint8_t {
  ok,
  absent,   ///< not there, and not needed
  missing,  ///< the remedy stands behind it
};

class Report {
 public:
  explicit Report(std::ostream& out) : out_(out) {}
  void line(Mark mark, std::string_view text) {
    static constexpr std::array<std::string_view, 3> kMarks = {"ok", "--", "!!"};
    out_ << kMarks[static_cast<std::size_t>(mark)] << "  " << printable(text) << '\n';
  }
  template <class First, class... Rest>
  void line(Mark mark, fmt::format_string<First, Rest...> text, First&& first, Rest&&... rest) {
    line(mark, fmt::format(text, std::forward<First>(first), std::forward<Rest>(rest)...));
  }

 private:
  std::ostream& out_;
};

// May this user open the nodes of virtual devices, and if not, why not.

/// What decides whether a node that the udev rule gives to group `tagwrench` can be opened.
struct NodeAccess {
  bool rule_installed = false;
  bool rule_applied = false;  ///< the node belongs to the group, which may read and write it
  bool member = false;        ///< the user is in it, by the system's list of groups
  bool member_now = false;    ///< and this login knows it
};

/// What to do when the node cannot be opened for want of permission.
std::string access_advice(const NodeAccess& access);

/// What is so for `node` and who runs this.
NodeAccess look_at_access(const std::filesystem::path& node);

/// Our devices among those of `folder` (/sys/class/hidraw): by the name that their uevent gives.
std::vector<std::string> our_hidraw(const std::filesystem::path& folder);

// The sensors that run on this computer, and whether one starts by itself.

/// Names of the sensors whose control sockets lie in `folder` and are listened to.
std::vector<std::string> running_sensors(const std::filesystem::path& folder);

/// Whether a user of `home` has told systemd to start it at login.
bool starts_at_login(const std::filesystem::path& home_configuration);

// Through which socket CAD programs reach the puck, and what is between them.

/// A socket of the spnav protocol.
enum class SpnavServer : std::uint8_t {
  none,       ///< there is nothing at the path
  silent,     ///< something is there, but nobody answers: a left-over, or put there for Blender
  tagwrench,  ///< `tagwrench spnav`, or the one of `tagwrench run --output spnav`
  other,      ///< spacenavd
};

/// Connects, and hangs up.
SpnavServer server_at(const std::filesystem::path& socket);

struct SpnavFacts {
  std::optional<int> spacenavd;  ///< its process id
  SpnavServer system = SpnavServer::none;
  std::string own_path;  ///< where `run --output spnav` serves; empty: nowhere
  SpnavServer own = SpnavServer::none;
  std::string chosen_path;  ///< SPNAV_SOCKET; empty: not set
  SpnavServer chosen = SpnavServer::none;
};

void say_spnav(Report& report, const SpnavFacts& facts);

/// A CAD program in a sandbox that hides the socket from it.
struct SandboxedProgram {
  std::string name, advice;
};

/// Those of flatpak (system's and user's folder of installed applications) and snap.
std::vector<SandboxedProgram> sandboxed_programs(const std::vector<std::filesystem::path>& flatpak,
                                                 const std::filesystem::path& snap);

}  // namespace tagwrench
