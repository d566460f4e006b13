#include "host/core/os/atomic_file.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <fstream>
#include <sstream>
#include <stdexcept>

#include "host/core/config_error.h"
#include "host/core/os/unique_fd.h"

namespace tagwrench {
namespace {

namespace fs = std::filesystem;

/// What the path means after symbolic links; the path itself where there is nothing yet.
fs::path resolved(const fs::path& path) {
  std::error_code error;
  const fs::path real = fs::weakly_canonical(path, error);
  return error ? path : real;
}

template <class Error>
[[noreturn]] void cannot_write(const fs::path& path) {
  throw Error(
      fmt::format("{}: cannot be written ({}); the old file is as it was: free some space, mend "
                  "the permissions, or name another file with --out",
                  path.string(), std::strerror(errno)));
}

/// A temporary file that goes away unless it has been renamed.
class Temporary {
 public:
  explicit Temporary(const fs::path& target)
      : target_(target),
        name_(target.string() + ".XXXXXX"),
        file_(::mkostemp(name_.data(), O_CLOEXEC)) {
    if (!file_) cannot_write<ConfigError>(target_);
  }
  Temporary(const Temporary&) = delete;
  Temporary& operator=(const Temporary&) = delete;
  ~Temporary() {
    if (!renamed_ && file_) ::unlink(name_.c_str());
  }

  void keep_mode_of_target() {
    struct stat old {};
    if (::stat(target_.c_str(), &old) == 0) {
      // Another's file stays another's where we may; the mode comes last, chown clears bits of it.
      [[maybe_unused]] const int ignored = ::fchown(file_.get(), old.st_uid, old.st_gid);
      if (::fchmod(file_.get(), old.st_mode & 07777) != 0)
        cannot_write<std::runtime_error>(target_);
      return;
    }
    const mode_t mask = ::umask(0);
    ::umask(mask);
    ::fchmod(file_.get(), 0666 & ~mask);
  }
  void write(std::string_view text) {
    while (!text.empty()) {
      const ssize_t written = ::write(file_.get(), text.data(), text.size());
      if (written < 0 && errno == EINTR) continue;
      if (written <= 0) cannot_write<std::runtime_error>(target_);
      text.remove_prefix(static_cast<std::size_t>(written));
    }
  }
  void take_the_name() {
    if (::fsync(file_.get()) != 0 || ::rename(name_.c_str(), target_.c_str()) != 0)
      cannot_write<std::runtime_error>(target_);
    renamed_ = true;
  }

 private:
  fs::path target_;
  std::string name_;
  UniqueFd file_;
  bool renamed_ = false;
};

}  // namespace

void check_replaceable(const fs::path& path) {
  const fs::path real = resolved(path);
  std::error_code error;
  const fs::file_status status = fs::status(real, error);
  if (fs::exists(status) && !fs::is_regular_file(status))
    throw ConfigError("{}: is not a regular file; name another file with --out", path.string());
  if (fs::exists(status) && ::access(real.c_str(), W_OK) != 0) {
    throw ConfigError("{}: is write-protected ({}); chmod u+w it, or name another file with --out",
                      path.string(), std::strerror(errno));
  }
  const fs::path folder = real.has_parent_path() ? real.parent_path() : fs::path(".");
  if (::access(folder.c_str(), W_OK | X_OK) != 0) {
    throw ConfigError("{}: its folder cannot be written ({}); name another file with --out",
                      path.string(), std::strerror(errno));
  }
}

void write_atomically(const fs::path& path, std::string_view text) {
  Temporary file(resolved(path));
  file.keep_mode_of_target();
  file.write(text);
  file.take_the_name();
}

std::string read_text(const fs::path& path) {
  std::error_code error;
  std::ifstream file;
  if (!fs::is_directory(path, error)) file.open(path, std::ios::binary);
  std::ostringstream text;
  if (!file.is_open() || !(text << file.rdbuf())) {
    throw ConfigError(
        "{}: cannot be read; check the path and that it is a readable, non-empty file",
        path.string());
  }
  return text.str();
}

}  // namespace tagwrench
