// Camera pixels to 8-bit luminance. The bytes come from a device and are not trusted.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "host/core/types.h"
#include "host/source/jpeg_luma.h"

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
/// Its V4L2 code.
std::uint32_t fourcc_of(PixelFormat format) noexcept;
/// Bytes that one row of pixels takes; 0 for mjpg.
int row_bytes(PixelFormat format, int width) noexcept;

/// Decodes frames of one format and size; every buffer is allocated at construction (libjpeg keeps
/// its own pools).
class Decoder {
 public:
  /// `stride` is the distance between rows in bytes; 0, or anything too small, means packed rows.
  Decoder(PixelFormat format, int width, int height, int stride);

  /// `bytes_used` of `buffer` hold a frame. At least the `wanted` part of it becomes readable in
  /// `image` (empty: all); `decoded` tells which. Elsewhere the image holds what earlier frames
  /// left there. Decoding the same buffer again with more wanted leaves what was readable as it
  /// was. False: truncated, corrupt or of another size, and `image` and `decoded` are untouched. Of
  /// a JPEG no more is looked at than the wanted part requires (see JpegLuma): cut off below it is
  /// good.
  bool decode(std::span<const std::uint8_t> buffer, std::size_t bytes_used, const Region& wanted,
              ImageView& image, Region& decoded) noexcept;
  /// All of it.
  bool decode(std::span<const std::uint8_t> buffer, std::size_t bytes_used,
              ImageView& image) noexcept;

  /// Whether the image points into the buffer (grey, nv12), which must then outlive it.
  bool borrows() const noexcept {
    return format_ == PixelFormat::grey || format_ == PixelFormat::nv12;
  }

 private:
  PixelFormat format_;
  int width_;
  int height_;
  int stride_;
  std::vector<std::uint8_t> luma_;
  std::optional<JpegLuma> jpeg_;
};

// Frames as they came, of whatever format, to luminance: what replays a folder or a recording. The
// bytes come from files and are not trusted.

// The size of a picture from its first bytes, so that a whole folder can be checked before the
// first frame.

struct ImageSize {
  int width = 0;
  int height = 0;
  bool operator==(const ImageSize&) const = default;
};

/// Of a PNG (ISO/IEC 15948, IHDR), a JPEG (ITU-T T.81, SOFn) or a binary or plain PGM. Nothing
/// where the bytes are none of these or end before the size.
std::optional<ImageSize> image_size(std::span<const std::uint8_t> bytes) noexcept;

// Grey levels of a PGM file (netpbm's portable graymap), binary (P5) or plain (P2). Pure.

struct PgmHeader {
  std::uint32_t width = 0;
  std::uint32_t height = 0;
  std::uint32_t white = 0;  ///< the largest count, 1 to 65535
  bool plain = false;
  std::size_t size = 0;  ///< bytes before the first pixel
};

/// Empty where the bytes are no PGM, or end before the header does.
std::optional<PgmHeader> pgm_header(std::span<const std::uint8_t> bytes) noexcept;

/// Row by row, no padding, scaled so that white is 255. False, with `grey` undefined, where the
/// file ends early, holds what is no number, or is not of this size.
bool decode_pgm(std::span<const std::uint8_t> bytes, int width, int height,
                std::vector<std::uint8_t>& grey);

class RawDecoder {
 public:
  RawDecoder(int width, int height) : width_(width), height_(height) {}

  /// Fills `image` and `decoded` of the frame, at least the `wanted` part (empty: all); the pixels
  /// are the very ones that the source of `raw` delivered. PNG and PGM are decoded whole. `raw`
  /// must outlive the frame, which is valid until the next call. Decoding the same bytes again with
  /// more wanted leaves what was readable as it was. False: unknown format, damaged, or of another
  /// size.
  bool decode(const RawFrame& raw, const Region& wanted, Frame& frame) noexcept;

 private:
  int width_, height_;
  std::vector<std::uint8_t> grey_;  ///< of a PNG or PGM
  std::optional<Decoder> decoder_;  ///< of everything else
  std::uint32_t decodes_ = 0;       ///< its format
  int stride_ = 0;
};

}  // namespace tagwrench
