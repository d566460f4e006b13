#include "host/source/decode.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <cstddef>
#include <optional>
#include <vector>

#include "host/core/png/png.h"

namespace tagwrench {
namespace {

constexpr std::array<std::string_view, 5> kNames = {"GREY", "NV12", "YUYV", "UYVY", "MJPG"};
std::uint32_t code(std::string_view text) {
  std::uint32_t value = 0;
  for (std::size_t i = 4; i-- > 0;) value = value << 8 | static_cast<std::uint8_t>(text[i]);
  return value;
}

void take_every_second_byte(const std::uint8_t* __restrict from, std::uint8_t* __restrict to,
                            int count) {
  for (int x = 0; x < count; ++x) to[x] = from[2 * x];
}

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

std::optional<PixelFormat> pixel_format(std::uint32_t fourcc) noexcept {
  if (fourcc == code("JPEG")) return PixelFormat::mjpg;
  for (std::size_t i = 0; i < kNames.size(); ++i)
    if (fourcc == code(kNames[i])) return static_cast<PixelFormat>(i);
  return std::nullopt;
}

std::optional<PixelFormat> pixel_format(std::string_view text) noexcept {
  if (text.size() != 4) return std::nullopt;
  char upper[5] = {};
  std::transform(text.begin(), text.end(), upper,
                 [](unsigned char c) { return static_cast<char>(std::toupper(c)); });
  return pixel_format(code({upper, 4}));
}

std::string_view name(PixelFormat format) noexcept {
  return kNames[static_cast<std::size_t>(format)];
}

std::uint32_t fourcc_of(PixelFormat format) noexcept {
  return code(kNames[static_cast<std::size_t>(format)]);
}

int row_bytes(PixelFormat format, int width) noexcept {
  switch (format) {
    case PixelFormat::grey:
    case PixelFormat::nv12: return width;
    case PixelFormat::yuyv:
    case PixelFormat::uyvy: return 2 * width;
    case PixelFormat::mjpg: break;
  }
  return 0;
}

Decoder::Decoder(PixelFormat format, int width, int height, int stride)
    : format_(format),
      width_(width),
      height_(height),
      stride_(std::max(stride, row_bytes(format, width))) {
  if (!borrows()) luma_.resize(static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
  if (format == PixelFormat::mjpg) jpeg_.emplace(width, height);
}

bool Decoder::decode(std::span<const std::uint8_t> buffer, std::size_t bytes_used,
                     ImageView& image) noexcept {
  Region decoded;
  return decode(buffer, bytes_used, {}, image, decoded);
}

bool Decoder::decode(std::span<const std::uint8_t> buffer, std::size_t bytes_used,
                     const Region& wanted, ImageView& image, Region& decoded) noexcept {
  if (bytes_used == 0 || bytes_used > buffer.size()) return false;
  const auto bytes = buffer.first(bytes_used);
  const auto row = static_cast<std::size_t>(row_bytes(format_, width_));
  const auto step = static_cast<std::size_t>(stride_);
  if (format_ != PixelFormat::mjpg &&
      bytes.size() < step * static_cast<std::size_t>(height_ - 1) + row)
    return false;
  if (borrows()) {
    image = {bytes.data(), width_, height_, stride_};
    decoded = {0, 0, width_, height_};
    return true;
  }
  Region region = wanted.clipped(width_, height_);
  if (jpeg_) {
    const std::optional<Region> written = jpeg_->decode(bytes, region, luma_.data());
    if (!written) return false;
    region = *written;
  } else {
    const std::ptrdiff_t luma_at = format_ == PixelFormat::uyvy ? 1 : 0;
    for (int y = region.y; y < region.y + region.height; ++y) {
      take_every_second_byte(bytes.data() + y * std::ptrdiff_t{stride_} + 2 * region.x + luma_at,
                             luma_.data() + y * std::ptrdiff_t{width_} + region.x, region.width);
    }
  }
  image = {luma_.data(), width_, height_, width_};
  decoded = region;
  return true;
}

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
    if (bytes[at] == '#')
      while (at < bytes.size() && bytes[at] != '\n') ++at;
    else
      ++at;
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
      !is_space(bytes[2]))
    return std::nullopt;
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
      header->height != static_cast<std::uint32_t>(height))
    return false;
  grey.resize(static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
  const auto pixels = bytes.subspan(header->size);
  return header->plain ? decode_plain(pixels, header->white, grey)
                       : decode_binary(pixels, header->white, grey);
}

bool RawDecoder::decode(const RawFrame& raw, const Region& wanted, Frame& frame) noexcept {
  const bool pgm = raw.fourcc == fourcc("PGM ");
  if (pgm || raw.fourcc == fourcc("PNG ")) {
    // Asked first, so that a damaged file cannot make a decoder allocate without bound.
    if (image_size(raw.bytes) != ImageSize{width_, height_}) return false;
    if (!(pgm ? decode_pgm(raw.bytes, width_, height_, grey_)
              : decode_png(raw.bytes, width_, height_, grey_)))
      return false;
    frame.image = {grey_.data(), width_, height_, width_};
    frame.decoded = {};
    return true;
  }
  if (!decoder_ || decodes_ != raw.fourcc || stride_ != raw.stride) {
    const std::optional<PixelFormat> format = pixel_format(raw.fourcc);
    if (!format) return false;
    decoder_.emplace(*format, width_, height_, raw.stride);
    decodes_ = raw.fourcc;
    stride_ = raw.stride;
  }
  return decoder_->decode(raw.bytes, raw.bytes.size(), wanted, frame.image, frame.decoded);
}

}  // namespace tagwrench
