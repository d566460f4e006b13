// Files that are replaced as a whole, and read as one text.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

namespace tagwrench {

/// Throws ConfigError unless `path` (or what it links to) is a regular file that may be replaced,
/// or a new name in a folder that can be written.
void check_replaceable(const std::filesystem::path& path);

/// Replaces the file as a whole: a reader sees the old text or the new one, never a part. Follows a
/// symbolic link and keeps the permissions. Throws ConfigError if the folder takes no file,
/// std::runtime_error if writing fails later, and leaves the old file.
void write_atomically(const std::filesystem::path& path, std::string_view text);

/// The text of a file, whatever it holds. Throws ConfigError if it cannot be read.
std::string read_text(const std::filesystem::path& path);

}  // namespace tagwrench
