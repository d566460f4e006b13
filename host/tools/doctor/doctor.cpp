#include "host/tools/doctor/doctor.h"

#include <fmt/format.h>
#include <grp.h>
#include <sys/utsname.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <charconv>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <ostream>

#include "host/board/serial_places.h"
#include "host/source/v4l2_nodes.h"

namespace tagwrench {
namespace {

namespace fs = std::filesystem;

std::string read_file(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

std::string environment(const char* name) {
  const char* value = std::getenv(name);
  return value ? value : "";
}

void say_machine(Report& report) {
  utsname system{};
  ::uname(&system);
  std::string session = environment("XDG_SESSION_TYPE");
  if (session.empty()) {
    session = !environment("WAYLAND_DISPLAY").empty() ? "wayland"
              : !environment("DISPLAY").empty()       ? "x11"
                                                      : "no desktop";
  }
  report.line(Mark::ok, fmt::format("tagwrench {}, {} {}, session: {}", TAGWRENCH_VERSION,
                                    system.sysname, system.release, session));
}

void say_groups(Report& report) {
  std::array<gid_t, 256> groups{};
  int count = ::getgroups(static_cast<int>(groups.size()), groups.data());
  if (count <= 0) {
    groups[0] = ::getgid();
    count = 1;
  }
  std::string text;
  for (int i = 0; i < count; ++i) {
    const group* entry = ::getgrgid(groups[static_cast<std::size_t>(i)]);
    if (entry) text += fmt::format("{}{}", text.empty() ? "" : " ", entry->gr_name);
  }
  report.line(Mark::ok,
              fmt::format("user id {}, groups: {}", ::getuid(), text.empty() ? "none" : text));
}

void say_cameras(Report& report) {
  const auto nodes = list_camera_nodes();
  bool any = false;
  for (const CameraNode& node : nodes) {
    if (node.error == EACCES || node.error == EPERM) {
      report.line(Mark::missing,
                  fmt::format("camera {}: no permission; sudo usermod -aG video $USER, then log in "
                              "again",
                              node.path));
    } else if (node.captures) {
      any = true;
      const std::string holders = holders_text(node.path);
      report.line(
          Mark::ok,
          fmt::format("camera {}: {} ({}){}; modes: {}; can be locked: {}", node.path, node.card,
                      node.driver, holders.empty() ? "" : ", in use by " + holders,
                      describe(node.modes, 6), node.controls.empty() ? "nothing" : node.controls));
    } else if (node.error != 0) {
      report.line(Mark::absent, fmt::format("camera {}: does not answer: {}", node.path,
                                            std::strerror(node.error)));
    } else {
      report.line(Mark::absent, fmt::format("camera {}: {} ({}) cannot capture", node.path,
                                            node.card, node.driver));
    }
  }
  if (!any) {
    report.line(
        Mark::absent,
        "no camera that can be used: plug one in, or use --source sim (the simulated sensor)");
  }
}

/// Opening a port would reset the board behind it, so it is only asked whether one may.
void say_serial_ports(Report& report) {
  const std::vector<std::string> ports = link::stable_ports();
  for (const std::string& port : ports) {
    if (::access(port.c_str(), R_OK | W_OK) == 0) {
      const std::string holder = link::holder_of(port);
      report.line(Mark::ok, fmt::format("serial port {}{}; `tagwrench board info` asks who it is",
                                        port, holder.empty() ? "" : ", in use by " + holder));
    } else {
      report.line(Mark::missing,
                  fmt::format("serial port {}: {}", port, link::permission_advice(port)));
    }
  }
  if (ports.empty())
    report.line(Mark::absent, "no USB serial port: no board for light and load cells");
}

/// Ports by which this board could be a USB device of another computer; most computers have none.
void say_device_ports(Report& report) {
  std::error_code error;
  fs::directory_iterator it("/sys/class/udc", error);
  for (; !error && it != fs::directory_iterator(); it.increment(error)) {
    report.line(Mark::ok, fmt::format("USB device port {}: `sudo tagwrench gadget up` makes it a "
                                      "puck for another computer, `gadget status` says how it is",
                                      it->path().filename().string()));
  }
}

void say_other_devices(Report& report) {
  const auto devices = other_6dof_devices(read_file("/proc/bus/input/devices"));
  if (devices.empty()) report.line(Mark::ok, "no other 6-DOF device competes for spacenavd");
  for (const InputDevice& device : devices) {
    report.line(Mark::missing,
                fmt::format("{} ({:04x}:{:04x}): spacenavd serves one device, the one plugged in "
                            "last; start tagwrench after it, or unplug it",
                            device.name, device.vendor, device.product));
  }
}

std::string printable(std::string_view text) {
  std::string out(text.substr(0, 80));
  std::replace_if(
      out.begin(), out.end(), [](unsigned char c) { return c < ' ' || c == 127; }, '?');
  return out;
}

unsigned hex_after(std::string_view line, std::string_view key) {
  const auto at = line.find(key);
  unsigned value = 0;
  if (at == std::string_view::npos) return 0;
  const char* begin = line.data() + at + key.size();
  const auto [end, error] = std::from_chars(begin, line.data() + line.size(), value, 16);
  return error == std::errc{} && end != begin ? value : 0;
}

bool is_6dof(const InputDevice& device) {
  // The Logitech-branded ones, from spacenavd's table.
  constexpr std::array<unsigned, 10> kLogitech = {0xc603, 0xc605, 0xc606, 0xc621, 0xc623,
                                                  0xc625, 0xc626, 0xc627, 0xc628, 0xc62b};
  if (device.name.find("tagwrench") != std::string::npos) return false;
  return device.vendor == 0x256f || device.name.find("3Dconnexion") != std::string::npos ||
         (device.vendor == 0x046d &&
          std::find(kLogitech.begin(), kLogitech.end(), device.product) != kLogitech.end());
}

}  // namespace

std::vector<InputDevice> other_6dof_devices(std::string_view text) {
  std::vector<InputDevice> found;
  InputDevice device;
  while (!text.empty()) {
    const auto end = text.find('\n');
    const std::string_view line = text.substr(0, end);
    text = end == std::string_view::npos ? std::string_view{} : text.substr(end + 1);
    if (line.starts_with("I:")) {
      device = {{}, hex_after(line, "Vendor="), hex_after(line, "Product=")};
    } else if (line.starts_with("N: Name=")) {
      std::string_view name = line.substr(8);
      if (name.starts_with('"')) name.remove_prefix(1);
      if (name.ends_with('"')) name.remove_suffix(1);
      device.name = printable(name);
      if (is_6dof(device)) found.push_back(device);
    }
  }
  return found;
}

int run_doctor(std::ostream& out) {
  Report report(out);
  say_machine(report);
  say_groups(report);
  say_cameras(report);
  say_serial_ports(report);
  const bool uhid =
      say_device_node(report, "/dev/uhid", "uhid", "the outputs spacemouse and wrench");
  const bool uinput = say_device_node(report, "/dev/uinput", "uinput", "the output joystick");
  say_rule(report);
  say_hidraw(report);
  say_bridges(report);
  say_spnav(report, look_at_spnav());
  say_sandboxes(report);
  say_other_devices(report);
  say_device_ports(report);
  return uhid && uinput ? 0 : 1;
}

}  // namespace tagwrench
