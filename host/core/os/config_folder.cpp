#include "host/core/os/config_folder.h"

#include <cstdlib>

namespace tagwrench {

std::string config_folder() {
  const char* config = std::getenv("XDG_CONFIG_HOME");
  if (config != nullptr && *config == '/') return std::string(config) + "/tagwrench";
  const char* home = std::getenv("HOME");
  if (home != nullptr && *home == '/') return std::string(home) + "/.config/tagwrench";
  return {};
}

}  // namespace tagwrench
