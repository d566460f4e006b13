#include "host/source/decode.h"

#include <algorithm>
#include <array>
#include <cctype>

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

}  // namespace

std::optional<PixelFormat> pixel_format(std::uint32_t fourcc) noexcept {
  if (fourcc == code("JPEG")) return PixelFormat::mjpg;
  for (std::size_t i = 0; i < kNames.size(); ++i) {
    if (fourcc == code(kNames[i])) return static_cast<PixelFormat>(i);
  }
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
    case PixelFormat::nv12:
      return width;
    case PixelFormat::yuyv:
    case PixelFormat::uyvy:
      return 2 * width;
    case PixelFormat::mjpg:
      break;
  }
  return 0;
}

Decoder::Decoder(PixelFormat format, int width, int height, int stride)
    : format_(format),
      width_(width),
      height_(height),
      stride_(std::max(stride, row_bytes(format, width))) {
  if (!borrows()) {
    luma_.resize(static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
  }
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
      bytes.size() < step * static_cast<std::size_t>(height_ - 1) + row) {
    return false;
  }
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

}  // namespace tagwrench
