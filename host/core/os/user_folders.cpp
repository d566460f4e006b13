#include "host/core/os/user_folders.h"

#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <cstring>

#include "host/core/config_error.h"

namespace tagwrench {
namespace {

std::string place() {
  const char* given = std::getenv("XDG_RUNTIME_DIR");
  if (given != nullptr && given[0] == '/') return std::string(given) + "/tagwrench";
  if (::getuid() == 0) return "/run/tagwrench";
  return "/tmp/tagwrench-" + std::to_string(::getuid());
}

}  // namespace

std::string config_folder() {
  const char* config = std::getenv("XDG_CONFIG_HOME");
  if (config != nullptr && *config == '/') return std::string(config) + "/tagwrench";
  const char* home = std::getenv("HOME");
  if (home != nullptr && *home == '/') return std::string(home) + "/.config/tagwrench";
  return {};
}

std::string runtime_folder() {
  const std::string folder = place();
  if (::mkdir(folder.c_str(), 0700) != 0 && errno != EEXIST)
    throw ConfigError(folder + ": cannot be made: " + std::strerror(errno) +
                      "; set XDG_RUNTIME_DIR to a folder of yours");
  struct stat found {};
  const bool ours = ::lstat(folder.c_str(), &found) == 0 && S_ISDIR(found.st_mode) &&
                    found.st_uid == ::getuid() && (found.st_mode & 0022) == 0;
  if (!ours) {
    throw ConfigError(folder +
                      ": is not a folder that only you can write to; remove it, or set "
                      "XDG_RUNTIME_DIR to a folder of yours");
  }
  ::chmod(folder.c_str(), 0700);  // an older version, or somebody's umask, may have made it
  return folder;
}

}  // namespace tagwrench
