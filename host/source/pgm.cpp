#include "host/source/pgm.h"

#include <algorithm>

namespace tagwrench {
namespace {

constexpr std::uint32_t kMaxCounts = 65535;

bool is_space(std::uint8_t c) { return c == ' ' || (c >= '\t' && c <= '\r'); }

/// Behind white space and comments; `at` is left behind its last digit. Empty where there is none,
/// or a larger one than any that a PGM may hold.
std::optional<std::uint32_t> number(std::span<const std::uint8_t> bytes, std::size_t& at) {
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
    if (*value > kMaxCounts) return std::nullopt;
  }
  return value;
}

std::uint8_t level(std::uint32_t count, std::uint32_t white) {
  return static_cast<std::uint8_t>((std::min(count, white) * 255 + white / 2) / white);
}

bool decode_plain(std::span<const std::uint8_t> text, std::uint32_t white,
                  std::vector<std::uint8_t>& grey) {
  std::size_t at = 0;
  for (std::uint8_t& pixel : grey) {
    const auto count = number(text, at);
    if (!count) return false;
    pixel = level(*count, white);
  }
  return true;
}

bool decode_binary(std::span<const std::uint8_t> data, std::uint32_t white,
                   std::vector<std::uint8_t>& grey) {
  const bool wide = white > 255;
  if (white == 255 && data.size() >= grey.size()) {
    std::copy_n(data.begin(), grey.size(), grey.begin());
    return true;
  }
  if (data.size() / (wide ? 2 : 1) < grey.size()) return false;
  for (std::size_t i = 0; i < grey.size(); ++i) {
    const std::uint32_t count =
        wide ? std::uint32_t{data[2 * i]} << 8 | data[2 * i + 1] : std::uint32_t{data[i]};
    grey[i] = level(count, white);
  }
  return true;
}

}  // namespace

std::optional<PgmHeader> pgm_header(std::span<const std::uint8_t> bytes) noexcept {
  if (bytes.size() < 3 || bytes[0] != 'P' || (bytes[1] != '5' && bytes[1] != '2') ||
      !is_space(bytes[2])) {
    return std::nullopt;
  }
  std::size_t at = 2;
  const auto width = number(bytes, at);
  const auto height = width ? number(bytes, at) : std::nullopt;
  const auto white = height ? number(bytes, at) : std::nullopt;
  // One white space ends the header: without it the last number may go on.
  if (!white || *white == 0 || at >= bytes.size() || !is_space(bytes[at])) return std::nullopt;
  return PgmHeader{*width, *height, *white, bytes[1] == '2', at + 1};
}

bool decode_pgm(std::span<const std::uint8_t> bytes, int width, int height,
                std::vector<std::uint8_t>& grey) {
  const auto header = pgm_header(bytes);
  if (!header || width < 1 || height < 1 || header->width != static_cast<std::uint32_t>(width) ||
      header->height != static_cast<std::uint32_t>(height)) {
    return false;
  }
  grey.resize(static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
  const auto pixels = bytes.subspan(header->size);
  return header->plain ? decode_plain(pixels, header->white, grey)
                       : decode_binary(pixels, header->white, grey);
}

}  // namespace tagwrench
