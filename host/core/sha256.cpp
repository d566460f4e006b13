#include "host/core/sha256.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <openssl/evp.h>

#include <array>
#include <fstream>
#include <memory>
#include <stdexcept>
#include <vector>

#include "host/core/config_error.h"

// Not fuzzed: bytes in, a hash out.

namespace tagwrench {
namespace {

using Digest = std::array<unsigned char, EVP_MAX_MD_SIZE>;

[[noreturn]] void no_sha256() {
  throw std::runtime_error("libcrypto has no SHA-256; install the system's libssl");
}

std::string hex(const Digest& digest, unsigned int length) {
  return fmt::format("{:02x}", fmt::join(std::span(digest).first(length), ""));
}

}  // namespace

std::string sha256_hex(std::span<const std::uint8_t> bytes) {
  Digest digest{};
  unsigned int length = 0;
  if (EVP_Digest(bytes.data(), bytes.size(), digest.data(), &length, EVP_sha256(), nullptr) != 1)
    no_sha256();
  return hex(digest, length);
}

std::string sha256_hex(std::string_view text) {
  return sha256_hex(std::span(reinterpret_cast<const std::uint8_t*>(text.data()), text.size()));
}

FileSha256 sha256_of_file(const std::filesystem::path& path) {
  constexpr std::size_t kPart = 1 << 20;
  const std::unique_ptr<EVP_MD_CTX, decltype(&EVP_MD_CTX_free)> context(EVP_MD_CTX_new(),
                                                                        &EVP_MD_CTX_free);
  if (!context || EVP_DigestInit_ex(context.get(), EVP_sha256(), nullptr) != 1) no_sha256();
  std::error_code error;  // a pipe or a device may never end
  std::ifstream file;
  if (std::filesystem::is_regular_file(path, error)) file.open(path, std::ios::binary);
  std::vector<char> part(kPart);
  FileSha256 out;
  while (file.read(part.data(), kPart), file.gcount() > 0) {
    const auto got = static_cast<std::size_t>(file.gcount());
    if (EVP_DigestUpdate(context.get(), part.data(), got) != 1) no_sha256();
    out.bytes += got;
  }
  if (!file.eof()) {
    throw ConfigError("{}: cannot be read; check the path and that it is a readable file",
                      path.string());
  }
  Digest digest{};
  unsigned int length = 0;
  if (EVP_DigestFinal_ex(context.get(), digest.data(), &length) != 1) no_sha256();
  out.hex = hex(digest, length);
  return out;
}

}  // namespace tagwrench
