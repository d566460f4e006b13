#include "host/source/decode.h"

#include <turbojpeg.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cstdio>
#include <cstring>

#include "host/config_error.h"

namespace tagwrench {
namespace {

constexpr std::array<std::string_view, 5> kNames = {"GREY", "NV12", "YUYV", "UYVY", "MJPG"};
/// Surplus bytes before the end marker that are a camera's habit and not damage.
constexpr unsigned kMaxPadding = 64;

std::uint32_t code(std::string_view text) {
  std::uint32_t value = 0;
  for (std::size_t i = 4; i-- > 0;) value = value << 8 | static_cast<std::uint8_t>(text[i]);
  return value;
}

/// The picture is whole and only padding follows it: some webcams do so in every frame.
bool harmless(const char* warning) {
  unsigned count = 0;
  unsigned marker = 0;
  const int found = std::sscanf(
      warning, "Corrupt JPEG data: %u extraneous bytes before marker 0x%x", &count, &marker);
  return found == 2 && marker == 0xd9 && count <= kMaxPadding;
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

void Decoder::JpegCloser::operator()(void* handle) const noexcept { tjDestroy(handle); }

Decoder::Decoder(PixelFormat format, int width, int height, int stride)
    : format_(format),
      width_(width),
      height_(height),
      stride_(std::max(stride, row_bytes(format, width))) {
  if (!borrows()) {
    luma_.resize(static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
  }
  if (format == PixelFormat::mjpg) {
    jpeg_.reset(tjInitDecompress());
    if (!jpeg_) throw ConfigError("libturbojpeg: cannot start a decoder: out of memory");
  }
}

Decoder::~Decoder() = default;
Decoder::Decoder(Decoder&&) noexcept = default;
Decoder& Decoder::operator=(Decoder&&) noexcept = default;

bool Decoder::decode(std::span<const std::uint8_t> buffer, std::size_t bytes_used,
                     ImageView& image) noexcept {
  if (bytes_used == 0 || bytes_used > buffer.size()) return false;
  const auto bytes = buffer.first(bytes_used);
  const auto row = static_cast<std::size_t>(row_bytes(format_, width_));
  const auto step = static_cast<std::size_t>(stride_);
  if (format_ != PixelFormat::mjpg &&
      bytes.size() < step * static_cast<std::size_t>(height_ - 1) + row) {
    return false;
  }
  switch (format_) {
    case PixelFormat::grey:
    case PixelFormat::nv12:
      image = {bytes.data(), width_, height_, stride_};
      return true;
    case PixelFormat::yuyv:
    case PixelFormat::uyvy: {
      const std::uint8_t* from = bytes.data() + (format_ == PixelFormat::uyvy ? 1 : 0);
      for (int y = 0; y < height_; ++y, from += step) {
        take_every_second_byte(from, luma_.data() + static_cast<std::ptrdiff_t>(y) * width_,
                               width_);
      }
      break;
    }
    case PixelFormat::mjpg:
      if (!decode_jpeg(bytes)) {
        // libjpeg can stay unusable after damaged tables, and would lend them to frames that bring
        // none.
        jpeg_.reset(tjInitDecompress());
        return false;
      }
      break;
  }
  image = {luma_.data(), width_, height_, width_};
  return true;
}

bool Decoder::decode_jpeg(std::span<const std::uint8_t> jpeg) noexcept {
  int width = 0;
  int height = 0;
  int subsampling = 0;
  int colour_space = 0;
  const auto size = static_cast<unsigned long>(jpeg.size());
  if (!jpeg_) return false;
  if (tjDecompressHeader3(jpeg_.get(), jpeg.data(), size, &width, &height, &subsampling,
                          &colour_space) != 0 ||
      width != width_ || height != height_) {
    return false;
  }
  // Grey output makes libjpeg skip the chroma transforms. Huffman tables that a webcam leaves out
  // are the standard ones, which libjpeg-turbo supplies by itself.
  if (tjDecompress2(jpeg_.get(), jpeg.data(), size, luma_.data(), width_, width_, height_,
                    TJPF_GRAY, TJFLAG_LIMITSCANS) == 0) {
    return true;
  }
  return tjGetErrorCode(jpeg_.get()) == TJERR_WARNING && harmless(tjGetErrorStr2(jpeg_.get()));
}

}  // namespace tagwrench
