#include "host/recording/trouble.h"

#include <fmt/format.h>
#include <sqlite3.h>
#include <sys/resource.h>

#include <algorithm>
#include <cerrno>
#include <cstdint>
#include <optional>
#include <system_error>

namespace tagwrench::record {
namespace {

struct Cause {
  std::string what;
  std::string remedy;
};

constexpr const char* kLess = "keep less of each frame (--keep region)";

std::uint64_t size_of(const std::filesystem::path& path) {
  std::error_code error;
  const std::uintmax_t size = std::filesystem::file_size(path, error);
  return error ? 0 : size;
}

/// Bytes, where the file or its log is about as large as this process may make one.
std::optional<std::uint64_t> limit_reached(const std::filesystem::path& path) {
  rlimit limit{};
  if (::getrlimit(RLIMIT_FSIZE, &limit) != 0 || limit.rlim_cur == RLIM_INFINITY) return {};
  constexpr std::uint64_t kNextWrite = 64UL << 10;  // that did not fit any more
  const std::uint64_t size = std::max(size_of(path), size_of(path.string() + "-wal"));
  if (size + kNextWrite < limit.rlim_cur) return {};
  return limit.rlim_cur;
}

/// Of a file that cannot grow; empty: something else.
std::optional<Cause> cannot_grow(const std::filesystem::path& path, const DatabaseError& error) {
  const int kind = error.code() & 0xff;
  const int system = error.system_errno();
  if (kind != SQLITE_FULL && kind != SQLITE_IOERR) return {};
  // First, because a write that ended in the middle passes for a full disk, or has no errno.
  if (const auto limit = limit_reached(path)) {
    return Cause{
        fmt::format("files may have {:.3g} MB here (ulimit -f)", static_cast<double>(*limit) / 1e6),
        fmt::format("raise that limit, or {}", kLess)};
  }
  if (system == EFBIG)
    return Cause{"this disk takes no larger files (FAT: 4 GB)",
                 fmt::format("choose another disk, or {}", kLess)};
  if (system == EDQUOT)
    return Cause{"your quota on this disk is used up",
                 fmt::format("free some space, choose another disk, or {}", kLess)};
  if (kind != SQLITE_FULL && system != ENOSPC) return {};
  return Cause{"the disk is full",
               fmt::format("free some space, choose another disk, or {}", kLess)};
}

}  // namespace

std::string write_trouble(const std::filesystem::path& path, const DatabaseError& error,
                          std::string_view kept) {
  if (const auto cause = cannot_grow(path, error)) {
    return fmt::format("{}: the file could not grow: {}; {}; {}", path.string(), cause->what, kept,
                       cause->remedy);
  }
  return fmt::format("{}: cannot be written: {}; {}; look at the disk, and choose another file",
                     path.string(), error.what(), kept);
}

}  // namespace tagwrench::record
