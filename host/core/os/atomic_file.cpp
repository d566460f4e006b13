#include "host/core/os/atomic_file.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <stdexcept>
#include <utility>

#include "host/core/config_error.h"

namespace tagwrench {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kMark = ".tagwrench-";  // of temporary names, which begin with a dot
constexpr std::string_view kRandom = "XXXXXX";
constexpr std::size_t kMostOfName = 200;  // of the target's: a name has at most 255 bytes

/// What the path means after symbolic links; the path itself where there is nothing yet. Throws
/// ConfigError: it is a link of somebody else's.
fs::path resolved(const fs::path& path) {
  refuse_foreign_link(path);
  std::error_code error;
  const fs::path real = fs::weakly_canonical(path, error);
  return error ? path : real;
}

fs::path folder_of(const fs::path& path) {
  return path.has_parent_path() ? path.parent_path() : fs::path(".");
}

/// Of a temporary name for the target, but for its random end.
std::string stem_of(const fs::path& target) {
  return fmt::format(".{}{}", target.filename().string().substr(0, kMostOfName), kMark);
}

template <class Error>
[[noreturn]] void cannot_write(const fs::path& path) {
  throw Error(
      fmt::format("{}: cannot be written ({}); the old file is as it was: free some space, mend "
                  "the permissions, or name another file with --out",
                  path.string(), std::strerror(errno)));
}

/// A device or a pipe would not be written to, it would be gone. Throws ConfigError.
void refuse_other_than_file(const fs::path& path, const fs::path& real) {
  std::error_code error;
  const fs::file_status status = fs::status(real, error);
  if (fs::exists(status) && !fs::is_regular_file(status))
    throw ConfigError("{}: is not a regular file; name another file with --out", path.string());
}

bool is_locked_by_us(int fd) noexcept { return ::flock(fd, LOCK_EX | LOCK_NB) == 0; }

/// Temporary files and folders of a writer that was killed: ours, and nobody holds their lock.
void remove_left_over(const fs::path& target) noexcept {
  const std::string stem = stem_of(target);
  std::error_code error;
  for (fs::directory_iterator entry(folder_of(target), error), end; !error && entry != end;
       entry.increment(error)) {
    const std::string name = entry->path().filename().string();
    if (!name.starts_with(stem) || name.size() != stem.size() + kRandom.size()) continue;
    const UniqueFd file(
        ::open(entry->path().c_str(), O_RDONLY | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK));
    struct stat facts {};
    const bool left_over = file && ::fstat(file.get(), &facts) == 0 &&
                           (S_ISREG(facts.st_mode) || S_ISDIR(facts.st_mode)) &&
                           facts.st_uid == ::geteuid() && is_locked_by_us(file.get());
    std::error_code ignored;
    if (left_over) fs::remove_all(entry->path(), ignored);
  }
}

/// Whether what we have locked still has its name: another writer may have taken it for a left-over
/// before that.
bool has_name(int fd) noexcept {
  struct stat facts {};
  return ::fstat(fd, &facts) == 0 && facts.st_nlink > 0;
}

/// False, and errno tells. A file system that cannot refuse by itself (NFS, say) is asked first.
bool renamed(const fs::path& from, const fs::path& to, bool only_new) noexcept {
  if (!only_new) return ::rename(from.c_str(), to.c_str()) == 0;
  if (::renameat2(AT_FDCWD, from.c_str(), AT_FDCWD, to.c_str(), RENAME_NOREPLACE) == 0) return true;
  if (errno != EINVAL && errno != ENOSYS) return false;
  if (::faccessat(AT_FDCWD, to.c_str(), F_OK, AT_SYMLINK_NOFOLLOW) == 0) {
    errno = EEXIST;
    return false;
  }
  return ::rename(from.c_str(), to.c_str()) == 0;
}

std::string name_for(const fs::path& target) {
  return (folder_of(target) / stem_of(target)).string() + std::string(kRandom);
}

void write_all(int fd, std::string_view bytes, const fs::path& target) {
  while (!bytes.empty()) {
    const ssize_t written = ::write(fd, bytes.data(), bytes.size());
    if (written < 0 && errno == EINTR) continue;
    if (written <= 0) cannot_write<std::runtime_error>(target);
    bytes.remove_prefix(static_cast<std::size_t>(written));
  }
}

}  // namespace

void refuse_foreign_link(const fs::path& path) {
  struct stat facts {};
  if (::lstat(path.c_str(), &facts) != 0 || !S_ISLNK(facts.st_mode)) return;
  if (facts.st_uid == 0 || facts.st_uid == ::geteuid()) return;
  throw ConfigError("{}: is a link that another user has put there; name another file",
                    path.string());
}

void check_replaceable(const fs::path& path) {
  const fs::path real = resolved(path);
  refuse_other_than_file(path, real);
  if (::access(real.c_str(), F_OK) == 0 && ::access(real.c_str(), W_OK) != 0) {
    throw ConfigError("{}: is write-protected ({}); chmod u+w it, or name another file with --out",
                      path.string(), std::strerror(errno));
  }
  if (::access(folder_of(real).c_str(), W_OK | X_OK) != 0) {
    throw ConfigError("{}: its folder cannot be written ({}); name another file with --out",
                      path.string(), std::strerror(errno));
  }
}

NewFile::NewFile(const fs::path& path) : target_(resolved(path)) {
  refuse_other_than_file(path, target_);
  remove_left_over(target_);
  while (!file_) {
    std::string name = name_for(target_);
    file_.reset(::mkostemp(name.data(), O_CLOEXEC));  // 0600, O_EXCL
    if (!file_) cannot_write<ConfigError>(target_);
    ::flock(file_.get(), LOCK_EX);
    if (has_name(file_.get()))
      name_ = name;
    else
      file_.reset();
  }
}

NewFile::NewFile(NewFile&& other) noexcept
    : target_(std::move(other.target_)),
      name_(std::exchange(other.name_, {})),
      file_(std::move(other.file_)) {}

NewFile::~NewFile() {
  if (!name_.empty()) ::unlink(name_.c_str());
}

void NewFile::write(std::string_view bytes) { write_all(file_.get(), bytes, target_); }

void NewFile::keep_mode_of_target() {
  struct stat old {};
  struct stat folder {};
  const bool there =
      ::stat(target_.c_str(), &old) == 0 && ::stat(folder_of(target_).c_str(), &folder) == 0;
  // Who has put a file of his there chose its mode, to get at what comes. In his own folder root
  // leaves it his: there he could take it anyway.
  const bool of_a_user = there && ::geteuid() == 0 && old.st_uid == folder.st_uid;
  if (of_a_user || (there && old.st_uid == ::geteuid())) {
    [[maybe_unused]] const int ignored = ::fchown(file_.get(), old.st_uid, old.st_gid);
    if (::fchmod(file_.get(), old.st_mode & 0777) != 0) cannot_write<std::runtime_error>(target_);
    return;
  }
  const mode_t mask = ::umask(0);
  ::umask(mask);
  ::fchmod(file_.get(), 0666 & ~mask);
}

void NewFile::take_the_name(Existing existing) {
  keep_mode_of_target();
  if (::fsync(file_.get()) != 0) cannot_write<std::runtime_error>(target_);
  if (!renamed(name_, target_, existing == Existing::refused)) {
    if (errno == EEXIST)
      throw std::runtime_error(
          fmt::format("{}: is there already; give another name, or --force", target_.string()));
    cannot_write<std::runtime_error>(target_);
  }
  name_.clear();
  sync_folder_of(target_);
}

NewFolder::NewFolder(const fs::path& path) : target_(resolved(path)) {
  remove_left_over(target_);
  while (!folder_) {
    std::string name = name_for(target_);
    if (::mkdtemp(name.data()) == nullptr) cannot_write<ConfigError>(target_);
    folder_.reset(::open(name.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC | O_NOFOLLOW));
    if (!folder_) cannot_write<ConfigError>(target_);
    ::flock(folder_.get(), LOCK_EX);
    if (has_name(folder_.get()))
      name_ = name;
    else
      folder_.reset();
  }
}

NewFolder::~NewFolder() {
  std::error_code ignored;
  if (!name_.empty()) fs::remove_all(name_, ignored);
}

void NewFolder::add(const std::string& name, std::string_view text,
                    std::span<const std::uint8_t> bytes) {
  const UniqueFd file(::openat(folder_.get(), name.c_str(),
                               O_WRONLY | O_CREAT | O_EXCL | O_NOFOLLOW | O_CLOEXEC, 0666));
  if (!file) cannot_write<std::runtime_error>(target_);
  write_all(file.get(), text, target_);
  write_all(file.get(), {reinterpret_cast<const char*>(bytes.data()), bytes.size()}, target_);
}

void NewFolder::take_the_name() {
  const mode_t mask = ::umask(0);
  ::umask(mask);
  if (::fchmod(folder_.get(), 0777 & ~mask) != 0 || ::syncfs(folder_.get()) != 0 ||
      ::rename(name_.c_str(), target_.c_str()) != 0)
    cannot_write<std::runtime_error>(target_);
  name_.clear();
  sync_folder_of(target_);
}

void write_atomically(const fs::path& path, std::string_view text) {
  NewFile file(path);
  file.write(text);
  file.take_the_name();
}

void sync_folder_of(const fs::path& path) noexcept {
  const UniqueFd folder(::open(folder_of(path).c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  if (folder) ::fsync(folder.get());
}

}  // namespace tagwrench
