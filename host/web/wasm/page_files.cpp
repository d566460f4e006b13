// The page's likes of sha256.cpp and png.cpp.
#include <algorithm>
#include <array>

#include "host/core/png/png.h"
#include "host/core/sha256.h"
#include "host/web/wasm/page.h"

namespace tagwrench {

std::string sha256_hex(std::span<const std::uint8_t> bytes) {
  constexpr std::string_view kDigits = "0123456789abcdef";
  std::array<std::uint8_t, 32> digest{};
  page_sha256(bytes.data(), bytes.size(), digest.data());
  std::string out;
  for (const std::uint8_t byte : digest) {
    out += kDigits[byte >> 4];
    out += kDigits[byte & 15];
  }
  return out;
}

std::string sha256_hex(std::string_view text) {
  return sha256_hex(std::span(reinterpret_cast<const std::uint8_t*>(text.data()), text.size()));
}

/// ISO/IEC 15948, 5.2 and 11.2.2: the signature, then the chunk IHDR.
std::optional<PngHeader> png_header(std::span<const std::uint8_t> bytes) noexcept {
  constexpr std::array<std::uint8_t, 16> kStart = {0x89, 'P', 'N', 'G', '\r', '\n', 0x1a, '\n',
                                                   0,    0,   0,   13,  'I',  'H',  'D',  'R'};
  constexpr std::size_t kHeader = kStart.size() + 13 + 4;  // its 13 bytes and their check sum
  if (bytes.size() < kHeader || !std::equal(kStart.begin(), kStart.end(), bytes.begin()))
    return std::nullopt;
  const auto number = [&bytes](std::size_t at) {
    return std::uint32_t{bytes[at]} << 24 | std::uint32_t{bytes[at + 1]} << 16 |
           std::uint32_t{bytes[at + 2]} << 8 | bytes[at + 3];
  };
  PngHeader header{number(16), number(20), bytes[24], bytes[25] == 0};
  if (header.width == 0 || header.height == 0) return std::nullopt;
  return header;
}

bool decode_png(std::span<const std::uint8_t> bytes, int width, int height,
                std::vector<std::uint16_t>& grey) {
  grey.resize(static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
  return page_decode_png(bytes.data(), bytes.size(), width, height, grey.data());
}

}  // namespace tagwrench
