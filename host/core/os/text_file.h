// Files that are read as one text.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>

namespace tagwrench {

/// What any of them may hold at most; those that people write have far less.
inline constexpr std::uint64_t kMaxText_bytes = std::uint64_t{256} << 20;

/// The text of a regular file, whatever it holds; a pipe or a device is not waited for. Throws
/// ConfigError: it cannot be read, is no regular file, or is longer than `most` bytes.
std::string read_text(const std::filesystem::path& path, std::uint64_t most = kMaxText_bytes);

/// The same; nothing where read_text() throws.
std::optional<std::string> text_of_file(const std::filesystem::path& path,
                                        std::uint64_t most = kMaxText_bytes) noexcept;

}  // namespace tagwrench
