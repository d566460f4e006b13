#include "host/core/os/text_file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>

#include "host/core/config_error.h"
#include "host/core/os/remedy.h"
#include "host/core/os/unique_fd.h"

namespace tagwrench {
namespace {

namespace fs = std::filesystem;

[[noreturn]] void cannot_read(const fs::path& path) {
  throw ConfigError("{}: cannot be read ({}); {}", path.string(), std::strerror(errno),
                    remedy_for(errno, "check the path and its permissions"));
}

}  // namespace

std::string read_text(const fs::path& path, std::uint64_t most) {
  // Not waited for: a pipe, or a terminal, may never say anything, or never end.
  const UniqueFd file(::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK | O_NOCTTY));
  struct stat facts {};
  if (!file || ::fstat(file.get(), &facts) != 0) cannot_read(path);
  if (!S_ISREG(facts.st_mode)) {
    throw ConfigError("{}: is {}, not a regular file, which alone is read; check the path",
                      path.string(), S_ISDIR(facts.st_mode) ? "a folder" : "a pipe or a device");
  }
  const auto told = static_cast<std::uint64_t>(facts.st_size);
  std::string text(std::min(told, most) + 1, '\0');  // files of /proc tell none, others may grow
  std::size_t size = 0;
  for (ssize_t got = 1; got != 0 && size <= most;) {
    if (size == text.size()) text.resize(std::min<std::uint64_t>(2 * size, most + 1));
    got = ::read(file.get(), text.data() + size, text.size() - size);
    if (got < 0 && errno != EINTR) cannot_read(path);
    if (got > 0) size += static_cast<std::size_t>(got);
  }
  if (size > most) {
    throw ConfigError("{}: is longer than {} bytes, as none of its kind is; check the path",
                      path.string(), most);
  }
  text.resize(size);
  return text;
}

std::optional<std::string> text_of_file(const fs::path& path, std::uint64_t most) noexcept {
  try {
    return read_text(path, most);
  } catch (const std::exception&) {
    return {};
  }
}

}  // namespace tagwrench
