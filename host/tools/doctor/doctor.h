// Room tools/doctor: what of this machine is ready.
// In:  device nodes, groups, udev rules, cameras, serial ports, sockets of CAD programs.
// Out: a line each: ok, not needed, or missing with what to do.
// Then: access.h (permissions), cad_programs.h (spacenavd and ours), bridges.h (what runs).
//
// `tagwrench doctor`: what of this machine is ready, line by line, and what to do about the rest.
#pragma once

#include <iosfwd>
#include <string>
#include <string_view>
#include <vector>

namespace tagwrench {

/// Writes one line a finding: "ok" works, "--" is not there and not needed, "!!" is missing, with
/// the remedy behind it. Returns 0 when everything that a virtual device needs is in place
/// (/dev/uhid and /dev/uinput can be opened), else
/// 1. A camera is not needed for that: the simulated sensor stands in.
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

}  // namespace tagwrench
