#include "host/source/raw_decoder.h"

#include <algorithm>
#include <cstddef>
#include <optional>
#include <vector>

#include "host/core/png/png.h"
#include "host/source/decode.h"

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

struct RawDecoder::State {
  int width = 0;
  int height = 0;
  std::vector<std::uint8_t> grey;  ///< of a PNG or PGM
  std::optional<Decoder> decoder;  ///< of everything else
  std::uint32_t decodes = 0;       ///< its format
  int stride = 0;

  bool decode_file(const RawFrame& raw, Frame& frame) {
    // Asked first, so that a damaged file cannot make a decoder allocate without bound.
    if (image_size(raw.bytes) != ImageSize{width, height}) return false;
    if (!(raw.fourcc == fourcc("PGM ") ? decode_pgm(raw.bytes, width, height, grey)
                                       : decode_png(raw.bytes, width, height, grey))) {
      return false;
    }
    frame.image = {grey.data(), width, height, width};
    frame.decoded = {};
    return true;
  }

  bool decode_camera(const RawFrame& raw, const Region& wanted, Frame& frame) {
    if (!decoder || decodes != raw.fourcc || stride != raw.stride) {
      const std::optional<PixelFormat> format = pixel_format(raw.fourcc);
      if (!format) return false;
      decoder.emplace(*format, width, height, raw.stride);
      decodes = raw.fourcc;
      stride = raw.stride;
    }
    return decoder->decode(raw.bytes, raw.bytes.size(), wanted, frame.image, frame.decoded);
  }
};

RawDecoder::RawDecoder(int width, int height) : state_(std::make_unique<State>()) {
  state_->width = width;
  state_->height = height;
}

RawDecoder::~RawDecoder() = default;

bool RawDecoder::decode(const RawFrame& raw, const Region& wanted, Frame& frame) noexcept {
  const bool file = raw.fourcc == fourcc("PNG ") || raw.fourcc == fourcc("PGM ");
  return file ? state_->decode_file(raw, frame) : state_->decode_camera(raw, wanted, frame);
}

}  // namespace tagwrench
