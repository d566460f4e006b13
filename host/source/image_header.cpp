#include "host/source/image_header.h"

#include <algorithm>
#include <array>
#include <cstddef>

namespace tagwrench {
namespace {

constexpr std::uint32_t kMaxSide = 16384;

std::optional<ImageSize> checked(std::uint32_t width, std::uint32_t height) {
  if (width < 1 || height < 1 || width > kMaxSide || height > kMaxSide) return std::nullopt;
  return ImageSize{static_cast<int>(width), static_cast<int>(height)};
}

std::uint32_t big_endian(std::span<const std::uint8_t> bytes) {
  std::uint32_t value = 0;
  for (const std::uint8_t byte : bytes) value = value << 8 | byte;
  return value;
}

std::optional<ImageSize> png_size(std::span<const std::uint8_t> bytes) {
  // 8 bytes of signature, chunk length, "IHDR", width, height.
  if (bytes.size() < 24) return std::nullopt;
  return checked(big_endian(bytes.subspan(16, 4)), big_endian(bytes.subspan(20, 4)));
}

bool is_frame_header(std::uint8_t marker) {
  return marker >= 0xC0 && marker <= 0xCF && marker != 0xC4 && marker != 0xC8 && marker != 0xCC;
}

std::optional<ImageSize> jpeg_size(std::span<const std::uint8_t> bytes) {
  std::size_t at = 2;
  while (at + 4 <= bytes.size()) {
    if (bytes[at] != 0xFF) return std::nullopt;
    const std::uint8_t marker = bytes[at + 1];
    if (marker == 0xFF) {
      ++at;  // fill byte
      continue;
    }
    const std::uint32_t length = big_endian(bytes.subspan(at + 2, 2));
    if (length < 2) return std::nullopt;
    if (is_frame_header(marker)) {
      // marker, length, precision, height, width
      if (at + 9 > bytes.size()) return std::nullopt;
      return checked(big_endian(bytes.subspan(at + 7, 2)), big_endian(bytes.subspan(at + 5, 2)));
    }
    at += 2 + length;
  }
  return std::nullopt;
}

bool is_space(std::uint8_t c) { return c == ' ' || (c >= '\t' && c <= '\r'); }

std::optional<std::uint32_t> pgm_number(std::span<const std::uint8_t> bytes, std::size_t& at) {
  while (at < bytes.size() && (is_space(bytes[at]) || bytes[at] == '#')) {
    if (bytes[at] == '#') {
      while (at < bytes.size() && bytes[at] != '\n') ++at;
    } else {
      ++at;
    }
  }
  std::optional<std::uint32_t> value;
  for (; at < bytes.size() && bytes[at] >= '0' && bytes[at] <= '9'; ++at) {
    value = value.value_or(0) * 10 + (bytes[at] - '0');
    if (*value > kMaxSide) return std::nullopt;
  }
  return at < bytes.size() ? value : std::nullopt;
}

std::optional<ImageSize> pgm_size(std::span<const std::uint8_t> bytes) {
  std::size_t at = 2;
  const auto width = pgm_number(bytes, at);
  const auto height = width ? pgm_number(bytes, at) : std::nullopt;
  if (!height) return std::nullopt;
  return checked(*width, *height);
}

}  // namespace

std::optional<ImageSize> image_size(std::span<const std::uint8_t> bytes) noexcept {
  constexpr std::array<std::uint8_t, 8> kPng = {0x89, 'P', 'N', 'G', '\r', '\n', 0x1A, '\n'};
  if (bytes.size() >= kPng.size() && std::equal(kPng.begin(), kPng.end(), bytes.begin())) {
    return png_size(bytes);
  }
  if (bytes.size() < 3) return std::nullopt;
  if (bytes[0] == 0xFF && bytes[1] == 0xD8) return jpeg_size(bytes);
  if (bytes[0] == 'P' && (bytes[1] == '5' || bytes[1] == '2') && is_space(bytes[2])) {
    return pgm_size(bytes);
  }
  return std::nullopt;
}

}  // namespace tagwrench
