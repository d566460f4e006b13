// Camera pixels to 8-bit luminance. The bytes come from a device and are not trusted.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "host/types.h"

namespace tagwrench {

/// The pixel formats that are understood; the values are ranks, cheapest to decode first.
enum class PixelFormat : std::uint8_t {
  grey,  ///< 8-bit luminance
  nv12,  ///< a luminance plane, then interleaved chroma at half resolution
  yuyv,  ///< Y0 U Y1 V
  uyvy,  ///< U Y0 V Y1
  mjpg,  ///< one JPEG a frame
};

/// A V4L2 code (little-endian characters, 'G' first in "GREY"); also takes "JPEG" for mjpg.
std::optional<PixelFormat> pixel_format(std::uint32_t fourcc) noexcept;
/// "GREY", "NV12", "YUYV", "UYVY", "MJPG", in any case.
std::optional<PixelFormat> pixel_format(std::string_view name) noexcept;
std::string_view name(PixelFormat format) noexcept;
/// Bytes that one row of pixels takes; 0 for mjpg.
int row_bytes(PixelFormat format, int width) noexcept;

/// Decodes frames of one format and size; every buffer is allocated at construction (libjpeg keeps
/// its own pools).
class Decoder {
 public:
  /// `stride` is the distance between rows in bytes; 0, or anything too small, means packed rows.
  Decoder(PixelFormat format, int width, int height, int stride);
  ~Decoder();
  Decoder(Decoder&&) noexcept;
  Decoder& operator=(Decoder&&) noexcept;
  Decoder(const Decoder&) = delete;
  Decoder& operator=(const Decoder&) = delete;

  /// `bytes_used` of `buffer` hold a frame. False: truncated, corrupt or of another size, and
  /// `image` is untouched.
  bool decode(std::span<const std::uint8_t> buffer, std::size_t bytes_used,
              ImageView& image) noexcept;

  /// Whether the image points into the buffer (grey, nv12), which must then outlive it.
  bool borrows() const noexcept {
    return format_ == PixelFormat::grey || format_ == PixelFormat::nv12;
  }

 private:
  bool decode_jpeg(std::span<const std::uint8_t> jpeg) noexcept;

  struct JpegCloser {
    void operator()(void* handle) const noexcept;
  };
  PixelFormat format_;
  int width_;
  int height_;
  int stride_;
  std::vector<std::uint8_t> luma_;
  std::unique_ptr<void, JpegCloser> jpeg_;
};

}  // namespace tagwrench
