#include "firmware/board/pc/port_name.h"

#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <filesystem>

namespace tagwrench {
namespace board {
namespace {

constexpr const char* kTerminals = "/dev/pts/";

/// Empty if `name` is no link.
std::string target_of(const std::string& name) {
  std::error_code none;
  return std::filesystem::read_symlink(name, none).string();
}

bool is_terminal(const std::string& target) {
  const std::size_t folder = std::strlen(kTerminals);
  return target.rfind(kTerminals, 0) == 0 && target.size() > folder &&
         target.find_first_not_of("0123456789", folder) == std::string::npos;
}

/// A terminal's file is there as long as a program has its other end. Opening it would tell as
/// much, and reset the board that is behind it.
bool served(const std::string& terminal) {
  std::error_code unknown;
  return std::filesystem::exists(terminal, unknown) || unknown;
}

}  // namespace

std::string take_name(const std::string& name, const std::string& terminal) {
  if (symlink(terminal.c_str(), name.c_str()) == 0) return "";
  if (errno == EEXIST) {
    const std::string target = target_of(name);
    if (target == terminal) return "";
    if (target.empty())
      return name + ": is there and no symbolic link; give --port a name that is free";
    if (!is_terminal(target))
      return name + ": is there and leads to " + target + "; give --port a name that is free";
    if (served(target))
      return name + ": another program serves it (" + target +
             "); give --port a name that is free, or end that program";
    if (unlink(name.c_str()) == 0 && symlink(terminal.c_str(), name.c_str()) == 0) return "";
  }
  return name + ": cannot be made: " + std::strerror(errno) +
         "; give --port a name in a folder that is there and that you may write to";
}

void leave_name(const std::string& name, const std::string& terminal) {
  if (target_of(name) == terminal) unlink(name.c_str());
}

}  // namespace board
}  // namespace tagwrench
