// From the target of a request to a file, and no other file. Pure but for open_confined().
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "host/core/os/unique_fd.h"

namespace tagwrench {

/// The parts of a path between slashes, decoded: names of letters, digits and "-_.~@+", none of
/// which begins with a dot.
struct SitePath {
  std::vector<std::string> names;
  bool folder = false;  ///< ends with a slash

  /// "/a/b", or "/a/b/" if it is a folder.
  std::string text() const;
};

/// Nothing: not the absolute path of one host's resource, or anything that could leave a folder or
/// mean something else to somebody else (dots, escapes of these, backslashes, zeros). A query does
/// not count.
std::optional<SitePath> parse_target(std::string_view target);

bool is_file_name(std::string_view name) noexcept;

struct OpenedFile {
  UniqueFd fd;
  std::uint64_t size = 0;
  std::int64_t changed_ns = 0;
};

/// A regular file below `folder`, on a way without symbolic links.
std::optional<OpenedFile> open_confined(const std::filesystem::path& folder,
                                        const std::vector<std::string>& names);

}  // namespace tagwrench
