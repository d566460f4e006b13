#include <fcntl.h>
#include <fmt/format.h>
#include <grp.h>
#include <pwd.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <optional>

#include "host/core/config_error.h"
#include "host/core/os/config_folder.h"
#include "host/core/os/runtime_folder.h"
#include "host/core/os/unique_fd.h"
#include "host/motion/control_socket.h"
#include "host/tools/doctor/doctor.h"

namespace tagwrench {
namespace {

namespace fs = std::filesystem;

constexpr const char* kGroup = "input";  // of 70-tagwrench.rules

bool present(const fs::path& path) {
  std::error_code error;
  return fs::exists(path, error);
}

std::optional<gid_t> group_id() {
  const group* entry = ::getgrnam(kGroup);
  if (entry == nullptr) return {};
  return entry->gr_gid;
}

bool listed_member(gid_t id) {
  const passwd* user = ::getpwuid(::getuid());
  if (user == nullptr) return false;
  std::vector<gid_t> groups(256);
  int count = static_cast<int>(groups.size());
  if (::getgrouplist(user->pw_name, user->pw_gid, groups.data(), &count) < 0) return false;
  groups.resize(static_cast<std::size_t>(count));
  return std::find(groups.begin(), groups.end(), id) != groups.end();
}

bool member_now(gid_t id) {
  std::vector<gid_t> groups(256);
  const int count = ::getgroups(static_cast<int>(groups.size()), groups.data());
  groups.resize(static_cast<std::size_t>(std::max(0, count)));
  return ::getegid() == id || std::find(groups.begin(), groups.end(), id) != groups.end();
}

}  // namespace

std::string access_advice(const NodeAccess& access) {
  if (!access.rule_installed) return "install the udev rule (next line), or run with sudo";
  if (!access.rule_applied) {
    return "the udev rule is not in force yet: sudo udevadm control --reload && sudo udevadm "
           "trigger";
  }
  if (access.member && !access.member_now)
    return "you are in group input since after you logged in: log out and in again";
  return "only who sits at this computer, logged in, may, and the group input; over ssh, or "
         "without "
         "a desktop: sudo usermod -aG input $USER, then log in again";
}

NodeAccess look_at_access(const fs::path& node) {
  NodeAccess access;
  access.rule_installed = !installed_rule().empty();
  const std::optional<gid_t> input = group_id();
  if (!input) return access;
  struct stat found {};
  constexpr mode_t kBoth = S_IRGRP | S_IWGRP;
  access.rule_applied = ::stat(node.c_str(), &found) == 0 && found.st_gid == *input &&
                        (found.st_mode & kBoth) == kBoth;
  access.member = listed_member(*input);
  access.member_now = member_now(*input);
  return access;
}

fs::path installed_rule() {
  for (const char* folder :
       {"/etc/udev/rules.d", "/run/udev/rules.d", "/usr/local/lib/udev/rules.d",
        "/usr/lib/udev/rules.d", "/lib/udev/rules.d"}) {
    const fs::path rule = fs::path(folder) / "70-tagwrench.rules";
    if (present(rule)) return rule;
  }
  return {};
}

void say_rule(Report& report) {
  if (const fs::path rule = installed_rule(); !rule.empty()) {
    report.line(Mark::ok, fmt::format("udev rule {}", rule.string()));
    return;
  }
  report.line(::getuid() == 0 ? Mark::absent : Mark::missing,
              "no udev rule, so only root can make devices: install the package, or sudo cmake "
              "--install build, then sudo udevadm control --reload && sudo udevadm trigger");
}

bool say_device_node(Report& report, const fs::path& node, const char* module, const char* use) {
  const UniqueFd fd(::open(node.c_str(), O_RDWR | O_NONBLOCK | O_CLOEXEC));
  if (fd) {
    report.line(Mark::ok, fmt::format("{} can be opened ({})", node.string(), use));
    return true;
  }
  const int error = errno;
  // The node may be a promise of a module that opening it would load.
  if (error == ENOENT || error == ENODEV || error == ENXIO) {
    const bool loaded = present(fs::path("/sys/module") / module);
    report.line(Mark::missing,
                fmt::format("{}: {}; needed for {}: sudo modprobe {}", node.string(),
                            loaded ? "the module is loaded but there is no device node"
                                   : "the module is not loaded",
                            use, module));
  } else if (error == EACCES || error == EPERM) {
    report.line(Mark::missing, fmt::format("{}: no permission; needed for {}: {}", node.string(),
                                           use, access_advice(look_at_access(node))));
  } else {
    report.line(Mark::missing, fmt::format("{}: cannot be opened: {}; needed for {}", node.string(),
                                           std::strerror(error), use));
  }
  return false;
}

std::vector<std::string> our_hidraw(const fs::path& folder) {
  constexpr std::string_view kName = "HID_NAME=";
  std::vector<std::string> ours;
  std::error_code error;
  fs::directory_iterator it(folder, error);
  for (; !error && it != fs::directory_iterator(); it.increment(error)) {
    std::ifstream uevent(it->path() / "device/uevent");
    for (std::string line; std::getline(uevent, line);) {
      if (line.starts_with(kName) && line.find("tagwrench") != std::string::npos)
        ours.push_back(it->path().filename().string());
    }
  }
  std::sort(ours.begin(), ours.end());
  return ours;
}

void say_hidraw(Report& report) {
  for (const std::string& name : our_hidraw("/sys/class/hidraw")) {
    const fs::path node = fs::path("/dev") / name;
    if (::access(node.c_str(), R_OK | W_OK) == 0) {
      report.line(Mark::ok, fmt::format("{}: a device of tagwrench, readable", node.string()));
    } else {
      report.line(Mark::missing,
                  fmt::format("{}: a device of tagwrench, but not readable for programs of yours: "
                              "{}",
                              node.string(), access_advice(look_at_access(node))));
    }
  }
}

namespace {

namespace fs = std::filesystem;

constexpr std::string_view kUnit = "tagwrench.service";

bool unit_installed() {
  std::error_code error;
  for (const char* folder :
       {"/usr/lib/systemd/user", "/usr/local/lib/systemd/user", "/etc/systemd/user"}) {
    if (fs::exists(fs::path(folder) / kUnit, error)) return true;
  }
  return false;
}

}  // namespace

std::vector<std::string> running_sensors(const fs::path& folder) {
  std::vector<std::string> names;
  std::error_code error;
  fs::directory_iterator it(folder, error);
  for (; !error && it != fs::directory_iterator(); it.increment(error)) {
    const fs::path& path = it->path();
    if (path.extension() != ".control") continue;
    try {
      if (listens(path.string())) names.push_back(path.stem().string());
    } catch (const ConfigError&) {
      continue;  // too long for a socket: not one of ours
    }
  }
  std::sort(names.begin(), names.end());
  return names;
}

bool starts_at_login(const fs::path& home_configuration) {
  std::error_code error;
  fs::directory_iterator it(home_configuration / "systemd/user", error);
  for (; !error && it != fs::directory_iterator(); it.increment(error)) {
    std::error_code unreadable;
    if (it->path().extension() == ".wants" &&
        fs::is_symlink(fs::symlink_status(it->path() / kUnit, unreadable)))
      return true;
  }
  return false;
}

void say_bridges(Report& report) {
  std::vector<std::string> names;
  try {
    names = running_sensors(runtime_folder());
  } catch (const ConfigError& e) {
    report.line(Mark::missing, e.what());
  }
  for (const std::string& name : names)
    report.line(Mark::ok, fmt::format("`tagwrench run` runs as '{}'", name));
  if (names.empty()) report.line(Mark::absent, "no sensor runs, or it waits for its camera");
  if (!unit_installed()) return;
  if (starts_at_login(fs::path(config_folder()).parent_path())) {
    report.line(Mark::ok,
                "it starts when you log in; `systemctl --user status tagwrench` and "
                "`journalctl --user -u tagwrench` say how it fares");
  } else {
    report.line(Mark::absent,
                "it does not start when you log in: systemctl --user enable --now tagwrench");
  }
}

}  // namespace tagwrench
