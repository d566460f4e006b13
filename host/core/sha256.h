// SHA-256 (FIPS 180-4), of libcrypto.
#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <string_view>

namespace tagwrench {

/// 64 lower-case hexadecimal digits.
std::string sha256_hex(std::span<const std::uint8_t> bytes);
std::string sha256_hex(std::string_view text);

struct FileSha256 {
  std::string hex;
  std::uintmax_t bytes = 0;
};
/// Of a file of any length. Throws ConfigError if it cannot be read.
FileSha256 sha256_of_file(const std::filesystem::path& path);

}  // namespace tagwrench
