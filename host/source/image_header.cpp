#include "host/source/image_header.h"

#include <cstddef>

#include "host/core/png/png.h"
#include "host/source/pgm.h"

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

}  // namespace

std::optional<ImageSize> image_size(std::span<const std::uint8_t> bytes) noexcept {
  if (bytes.size() >= 3 && bytes[0] == 0xFF && bytes[1] == 0xD8) return jpeg_size(bytes);
  if (const auto pgm = pgm_header(bytes)) return checked(pgm->width, pgm->height);
  if (const auto png = png_header(bytes)) return checked(png->width, png->height);
  return std::nullopt;
}

}  // namespace tagwrench
