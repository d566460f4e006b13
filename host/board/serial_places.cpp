#include "host/board/serial_places.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <grp.h>
#include <pwd.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <fstream>

#include "host/core/config_error.h"

namespace tagwrench::link {
namespace {

namespace fs = std::filesystem;

bool is_number(const std::string& name) {
  return !name.empty() &&
         std::all_of(name.begin(), name.end(), [](char c) { return c >= '0' && c <= '9'; });
}

bool has_open(const fs::path& process, const struct stat& device) {
  std::error_code error;
  for (fs::directory_iterator it(process / "fd", error), end; !error && it != end;
       it.increment(error)) {
    struct stat about {};
    if (::stat(it->path().c_str(), &about) == 0 && S_ISCHR(about.st_mode) &&
        about.st_rdev == device.st_rdev && about.st_ino == device.st_ino &&
        about.st_dev == device.st_dev)
      return true;
  }
  return false;
}

}  // namespace

std::vector<std::string> stable_ports(const std::string& folder) {
  std::vector<std::string> out;
  std::error_code error;
  for (fs::directory_iterator it(folder, error), end; !error && it != end; it.increment(error))
    out.push_back(it->path().string());
  std::sort(out.begin(), out.end());
  return out;
}

std::string port_advice(const std::string& option, const std::string& folder) {
  const std::vector<std::string> ports = stable_ports(folder);
  if (ports.empty()) return "no USB serial port is plugged in here: plug the board in";
  return fmt::format("give {} one of: {}", option, fmt::join(ports, ", "));
}

std::string group_of(const std::string& path) {
  struct stat about {};
  if (::stat(path.c_str(), &about) != 0) return "?";
  const group* found = ::getgrgid(about.st_gid);
  return found != nullptr ? found->gr_name : std::to_string(about.st_gid);
}

std::string permission_advice(const std::string& path) {
  struct stat about {};
  const bool known = ::stat(path.c_str(), &about) == 0;
  const mode_t both = S_IRGRP | S_IWGRP;
  if (!known || (about.st_gid != 0 && (about.st_mode & both) == both)) {
    const std::string group = group_of(path);
    return fmt::format("it belongs to the group {}: `sudo usermod -aG {} $USER`, then log in again",
                       group, group);
  }
  const passwd* owner = ::getpwuid(about.st_uid);
  return fmt::format("only its owner {} may open it: `sudo chown $USER {}`",
                     owner != nullptr ? owner->pw_name : std::to_string(about.st_uid), path);
}

std::string holder_of(const std::string& path) {
  struct stat device {};
  if (::stat(path.c_str(), &device) != 0) return {};
  std::error_code error;
  for (fs::directory_iterator it("/proc", error), end; !error && it != end; it.increment(error)) {
    const std::string name = it->path().filename().string();
    if (!is_number(name) || name == std::to_string(::getpid()) || !has_open(it->path(), device))
      continue;
    std::string program = "a program";
    std::ifstream(it->path() / "comm") >> program;
    return fmt::format("{} (process {})", program, name);
  }
  return {};
}

std::string only_port(const std::string& option, const std::string& folder) {
  const std::vector<std::string> ports = stable_ports(folder);
  if (ports.size() == 1) return ports.front();
  if (ports.empty())
    throw ConfigError(fmt::format(
        "board: no USB serial port is plugged in here; plug the board in, or give {} PATH",
        option));
  throw ConfigError(fmt::format("board: {} serial ports are plugged in; pick one with {}: {}",
                                ports.size(), option, fmt::join(ports, ", ")));
}

}  // namespace tagwrench::link
