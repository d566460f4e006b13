#include "host/tools/doctor/doctor.h"

#include <fcntl.h>
#include <grp.h>
#include <pwd.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <sys/utsname.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <iterator>

#include "host/board/serial_port.h"
#include "host/core/config_error.h"
#include "host/core/os/unique_fd.h"
#include "host/core/os/user_folders.h"
#include "host/core/parse.h"
#include "host/motion/control_socket.h"
#include "host/output/device_service.h"
#include "host/output/spnav_daemon.h"
#include "host/source/v4l2_device.h"

namespace tagwrench {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kUnit = "tagwrench.service";

bool present(const fs::path& path) {
  std::error_code error;
  return fs::exists(path, error);
}

/// What a folder holds, by name; nothing where it cannot be read.
std::vector<fs::path> entries(const fs::path& folder) {
  std::vector<fs::path> paths;
  std::error_code error;
  for (fs::directory_iterator it(folder, error), end; !error && it != end; it.increment(error))
    paths.push_back(it->path());
  std::sort(paths.begin(), paths.end());
  return paths;
}

/// The first of these folders that has the file; empty: none.
fs::path found_in(std::initializer_list<const char*> folders, std::string_view file) {
  for (const char* folder : folders)
    if (present(fs::path(folder) / file)) return fs::path(folder) / file;
  return {};
}

std::string environment(const char* name) {
  const char* value = std::getenv(name);
  return value ? value : "";
}

/// As this login knows them.
std::vector<gid_t> own_groups() {
  std::vector<gid_t> groups(256);
  groups.resize(std::max(0, ::getgroups(static_cast<int>(groups.size()), groups.data())));
  return groups;
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
  report.line(Mark::ok, "tagwrench {}, {} {}, session: {}", TAGWRENCH_VERSION, system.sysname,
              system.release, session);
}

void say_groups(Report& report) {
  std::vector<gid_t> groups = own_groups();
  if (groups.empty()) groups = {::getgid()};
  std::string text;
  for (const gid_t id : groups) {
    const group* entry = ::getgrgid(id);
    if (entry) text += fmt::format("{}{}", text.empty() ? "" : " ", entry->gr_name);
  }
  report.line(Mark::ok, "user id {}, groups: {}", ::getuid(), text.empty() ? "none" : text);
}

void say_cameras(Report& report) {
  const auto nodes = list_camera_nodes();
  bool any = false;
  for (const CameraNode& node : nodes) {
    if (node.error == EACCES || node.error == EPERM) {
      report.line(Mark::missing,
                  "camera {}: no permission; sudo usermod -aG video $USER, then log in again",
                  node.path);
    } else if (node.captures) {
      any = true;
      const std::string holders = holders_text(node.path);
      report.line(Mark::ok, "camera {}: {} ({}){}; modes: {}; can be locked: {}", node.path,
                  node.card, node.driver, holders.empty() ? "" : ", in use by " + holders,
                  describe(node.modes, 6), node.controls.empty() ? "nothing" : node.controls);
    } else if (node.error != 0) {
      report.line(Mark::absent, "camera {}: does not answer: {}", node.path,
                  std::strerror(node.error));
    } else {
      report.line(Mark::absent, "camera {}: {} ({}) cannot capture", node.path, node.card,
                  node.driver);
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
      report.line(Mark::ok, "serial port {}{}; `tagwrench board info` asks who it is", port,
                  holder.empty() ? "" : ", in use by " + holder);
    } else {
      report.line(Mark::missing, "serial port {}: {}", port, link::permission_advice(port));
    }
  }
  if (ports.empty())
    report.line(Mark::absent, "no USB serial port: no board for light and load cells");
}

fs::path installed_rule() {
  return found_in({"/etc/udev/rules.d", "/run/udev/rules.d", "/usr/local/lib/udev/rules.d",
                   "/usr/lib/udev/rules.d", "/lib/udev/rules.d"},
                  "70-tagwrench.rules");
}

void say_rule(Report& report) {
  if (const fs::path rule = installed_rule(); !rule.empty()) {
    report.line(Mark::ok, "udev rule {}", rule.string());
    return;
  }
  report.line(
      ::getuid() == 0 ? Mark::absent : Mark::missing,
      "no udev rule, so only root can make or read devices: install the package, or copy the rules "
      "of host/output to /etc/udev/rules.d, then sudo udevadm control --reload && sudo udevadm "
      "trigger");
}

bool say_device_node(Report& report, const DeviceNode& node, const char* use) {
  try {
    report.line(Mark::ok, "{} {} ({})", node.path(),
                open_device_node(node).lent ? "need not be opened: the service makes its devices"
                                            : "can be opened",
                use);
    return true;
  } catch (const ConfigError& e) {
    report.line(Mark::missing, "{}; needed for {}", e.what(), use);
    return false;
  }
}

void say_hidraw(Report& report) {
  for (const std::string& name : our_hidraw("/sys/class/hidraw")) {
    const fs::path node = fs::path("/dev") / name;
    if (::access(node.c_str(), R_OK | W_OK) == 0) {
      report.line(Mark::ok, "{}: a device of tagwrench, readable", node.string());
    } else {
      report.line(Mark::missing,
                  "{}: a device of tagwrench, but not readable for programs of yours: {}",
                  node.string(), access_advice(look_at_access(node)));
    }
  }
}

void say_bridges(Report& report) {
  std::vector<std::string> names;
  try {
    names = running_sensors(runtime_folder());
  } catch (const ConfigError& e) {
    report.line(Mark::missing, e.what());
  }
  for (const std::string& name : names) report.line(Mark::ok, "`tagwrench run` runs as '{}'", name);
  if (names.empty()) report.line(Mark::absent, "no sensor runs, or it waits for its camera");
  if (found_in({"/usr/lib/systemd/user", "/usr/local/lib/systemd/user", "/etc/systemd/user"}, kUnit)
          .empty())
    return;
  if (starts_at_login(fs::path(config_folder()).parent_path())) {
    report.line(Mark::ok,
                "it starts when you log in; `systemctl --user status tagwrench` and `journalctl "
                "--user -u tagwrench` say how it fares");
  } else {
    report.line(Mark::absent,
                "it does not start when you log in: systemctl --user enable --now tagwrench");
  }
}

std::optional<int> process_named(std::string_view name) {
  for (const fs::path& folder : entries("/proc")) {
    const auto pid = parse_whole<int>(folder.filename().string());
    std::ifstream file(folder / "comm");
    std::string comm;
    if (pid && std::getline(file, comm) && comm == name) return pid;
  }
  return std::nullopt;
}

void say_system_socket(Report& report, const SpnavFacts& facts) {
  if (facts.system == SpnavServer::tagwrench) {
    report.line(Mark::ok, "CAD programs reach tagwrench itself by {}", kSpnavSystemSocket);
  } else if (facts.system == SpnavServer::other && facts.spacenavd) {
    report.line(Mark::ok, "spacenavd runs (pid {}), socket {}", *facts.spacenavd,
                kSpnavSystemSocket);
  } else if (facts.system == SpnavServer::other) {
    report.line(Mark::ok, "a server of CAD programs answers at {}", kSpnavSystemSocket);
  } else if (facts.spacenavd) {
    report.line(
        Mark::missing,
        "spacenavd runs (pid {}) but does not answer at {}: sudo systemctl restart spacenavd",
        *facts.spacenavd, kSpnavSystemSocket);
  } else if (facts.own != SpnavServer::tagwrench) {
    report.line(Mark::absent,
                "spacenavd does not run; FreeCAD, Blender and others need it (sudo apt install "
                "spacenavd), or `tagwrench run --output spnav`");
  } else {
    report.line(Mark::absent, "spacenavd does not run; the next line says what does");
  }
}

SpnavFacts look_at_spnav() {
  SpnavFacts facts;
  facts.spacenavd = process_named("spacenavd");
  facts.system = server_at(kSpnavSystemSocket);
  try {
    facts.own_path = spnav_socket_path("");
    facts.own = server_at(facts.own_path);
  } catch (const ConfigError&) {
    facts.own_path.clear();  // no such place: `run --output spnav` says why
  }
  facts.chosen_path = environment("SPNAV_SOCKET");
  if (!facts.chosen_path.empty()) facts.chosen = server_at(facts.chosen_path);
  return facts;
}

void say_sandboxes(Report& report) {
  const fs::path home = environment("HOME");
  for (const SandboxedProgram& program :
       sandboxed_programs({"/var/lib/flatpak/app", home / ".local/share/flatpak/app"}, "/snap")) {
    report.line(Mark::absent, "{} does not see the puck by itself: {}", program.name,
                program.advice);
  }
}

/// Ports by which this board could be a USB device of another computer; most computers have none.
void say_device_ports(Report& report) {
  for (const fs::path& port : entries("/sys/class/udc")) {
    report.line(Mark::ok,
                "USB device port {}: `sudo tagwrench gadget up` makes it a puck for another "
                "computer, `gadget status` says how it is",
                port.filename().string());
  }
}

void say_other_devices(Report& report) {
  std::ifstream file("/proc/bus/input/devices", std::ios::binary);
  const auto devices = other_6dof_devices(std::string(std::istreambuf_iterator<char>(file), {}));
  if (devices.empty()) report.line(Mark::ok, "no other 6-DOF device competes for spacenavd");
  for (const InputDevice& device : devices) {
    report.line(Mark::missing,
                "{} ({:04x}:{:04x}): spacenavd serves one device, the one plugged in last; start "
                "tagwrench after it, or unplug it",
                device.name, device.vendor, device.product);
  }
}

bool listed_member(gid_t id) {
  const passwd* user = ::getpwuid(::getuid());
  if (user == nullptr) return false;
  std::vector<gid_t> groups(256);
  int count = static_cast<int>(groups.size());
  if (::getgrouplist(user->pw_name, user->pw_gid, groups.data(), &count) < 0) return false;
  groups.resize(count);
  return std::find(groups.begin(), groups.end(), id) != groups.end();
}

unsigned hex_after(std::string_view line, std::string_view key) {
  const auto at = line.find(key);
  if (at == std::string_view::npos) return 0;
  const std::string_view rest = line.substr(at + key.size());
  return parse_whole<unsigned>(rest.substr(0, rest.find(' ')), 16).value_or(0);
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

std::string access_advice(const NodeAccess& access) {
  if (!access.rule_installed) return "install the udev rule (next line), or run with sudo";
  if (!access.rule_applied) {
    return "the udev rule is not in force yet: sudo udevadm control --reload && sudo udevadm "
           "trigger";
  }
  if (access.member && !access.member_now)
    return "you are in group tagwrench since after you logged in: log out and in again";
  return "only who sits at this computer, logged in, may, and the group tagwrench; over ssh, or "
         "without a desktop: sudo usermod -aG tagwrench $USER, then log in again";
}

NodeAccess look_at_access(const fs::path& node) {
  NodeAccess access;
  access.rule_installed = !installed_rule().empty();
  const group* readers = ::getgrnam(kDeviceGroup);
  if (readers == nullptr) return access;
  const gid_t id = readers->gr_gid;
  struct stat found {};
  constexpr mode_t kBoth = S_IRGRP | S_IWGRP;
  access.rule_applied =
      ::stat(node.c_str(), &found) == 0 && found.st_gid == id && (found.st_mode & kBoth) == kBoth;
  access.member = listed_member(id);
  const std::vector<gid_t> groups = own_groups();
  access.member_now =
      ::getegid() == id || std::find(groups.begin(), groups.end(), id) != groups.end();
  return access;
}

std::vector<std::string> our_hidraw(const fs::path& folder) {
  std::vector<std::string> ours;
  for (const fs::path& entry : entries(folder)) {
    std::ifstream uevent(entry / "device/uevent");
    for (std::string line; std::getline(uevent, line);)
      if (line.starts_with("HID_NAME=") && line.find("tagwrench") != std::string::npos)
        ours.push_back(entry.filename().string());
  }
  return ours;
}

std::vector<std::string> running_sensors(const fs::path& folder) {
  std::vector<std::string> names;
  for (const fs::path& path : entries(folder)) {
    try {
      if (path.extension() == ".control" && listens(path.string()))
        names.push_back(path.stem().string());
    } catch (const ConfigError&) {
      continue;  // too long for a socket: not one of ours
    }
  }
  return names;
}

bool starts_at_login(const fs::path& home_configuration) {
  const std::vector<fs::path> targets = entries(home_configuration / "systemd/user");
  return std::any_of(targets.begin(), targets.end(), [](const fs::path& target) {
    std::error_code unreadable;
    return target.extension() == ".wants" &&
           fs::is_symlink(fs::symlink_status(target / kUnit, unreadable));
  });
}

SpnavServer server_at(const fs::path& socket) {
  if (!present(socket)) return SpnavServer::none;
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  if (socket.native().size() >= sizeof address.sun_path) return SpnavServer::silent;
  std::memcpy(address.sun_path, socket.c_str(), socket.native().size());
  const UniqueFd probe(::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
  if (!probe ||
      ::connect(probe.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0)
    return SpnavServer::silent;
  // The bridge's own socket lies beside a daemon's.
  return present(socket.string() + ".bridge") ? SpnavServer::tagwrench : SpnavServer::other;
}

void say_spnav(Report& report, const SpnavFacts& facts) {
  say_system_socket(report, facts);
  const bool own = facts.own == SpnavServer::tagwrench && facts.own_path != kSpnavSystemSocket;
  if (own) {
    report.line(Mark::ok, "programs started with SPNAV_SOCKET={} reach tagwrench itself",
                facts.own_path);
  }
  if (facts.chosen_path.empty()) {
    if (own && facts.system != SpnavServer::tagwrench && facts.system != SpnavServer::other) {
      report.line(Mark::absent,
                  "SPNAV_SOCKET is not set here, so programs use {}: put SPNAV_SOCKET={} into "
                  "~/.config/environment.d/tagwrench.conf and log in again",
                  kSpnavSystemSocket, facts.own_path);
    }
  } else if (facts.chosen == SpnavServer::none || facts.chosen == SpnavServer::silent) {
    report.line(Mark::missing,
                "SPNAV_SOCKET={}: nobody answers there, so programs started from here find no "
                "puck; run `tagwrench run --output spnav`, or unset it",
                facts.chosen_path);
  }
}

std::vector<SandboxedProgram> sandboxed_programs(const std::vector<fs::path>& flatpak,
                                                 const fs::path& snap) {
  struct Known {
    const char* name;
    const char* application;  // of flatpak
    const char* snap;
  };
  constexpr std::array<Known, 5> kKnown = {{{"FreeCAD", "org.freecad.FreeCAD", "freecad"},
                                            {"FreeCAD", "org.freecadweb.FreeCAD", nullptr},
                                            {"Blender", "org.blender.Blender", "blender"},
                                            {"OpenSCAD", "org.openscad.OpenSCAD", "openscad"},
                                            {"KiCad", "org.kicad.KiCad", nullptr}}};
  std::vector<SandboxedProgram> found;
  for (const Known& known : kKnown) {
    for (const fs::path& folder : flatpak) {
      if (!present(folder / known.application)) continue;
      found.push_back({fmt::format("{} of flatpak", known.name),
                       fmt::format("`tagwrench run --output spnav`, and once: flatpak override "
                                   "--user --filesystem=xdg-run/tagwrench "
                                   "--env=SPNAV_SOCKET=$XDG_RUNTIME_DIR/tagwrench/spnav.sock {}",
                                   known.application)});
      break;
    }
    if (known.snap != nullptr && present(snap / known.snap)) {
      found.push_back(
          {fmt::format("{} of snap", known.name),
           "a snap may not use sockets of others: install it from Debian or as an AppImage"});
    }
  }
  return found;
}

std::vector<InputDevice> other_6dof_devices(std::string_view text) {
  std::vector<InputDevice> found;
  InputDevice device;
  for (const std::string_view line : split(text, '\n')) {
    if (line.starts_with("I:")) {
      device = {{}, hex_after(line, "Vendor="), hex_after(line, "Product=")};
    } else if (line.starts_with("N: Name=")) {
      std::string_view name = line.substr(8);
      if (name.starts_with('"')) name.remove_prefix(1);
      if (name.ends_with('"')) name.remove_suffix(1);
      device.name = printable(name.substr(0, 80));
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
  const bool uhid = say_device_node(report, kUhidNode, "the outputs spacemouse and wrench");
  const bool uinput = say_device_node(report, kUinputNode, "the output joystick");
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
