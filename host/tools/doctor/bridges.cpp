#include "host/tools/doctor/bridges.h"

#include <fmt/format.h>

#include <algorithm>

#include "host/core/config_error.h"
#include "host/core/os/config_folder.h"
#include "host/core/os/runtime_folder.h"
#include "host/motion/control_socket.h"

namespace tagwrench {
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
