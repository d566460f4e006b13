// Camera pixels to 8-bit luminance: JPEG, the whole picture or only a part of it, through
// libjpeg-turbo's scanline interface; the raw formats; and whatever a folder or a recording holds.
// The bytes come from a device or a file and are not trusted.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "host/core/types.h"

namespace tagwrench {

class JpegLuma {
 public:
  /// For pictures of this size. Throws ConfigError when there is no memory.
  JpegLuma(int width, int height);
  ~JpegLuma();
  JpegLuma(JpegLuma&&) noexcept;
  JpegLuma& operator=(JpegLuma&&) noexcept;

  /// Decodes `region` (within the picture, not empty) into `luma`: `height` packed rows of `width`
  /// bytes, of which only the region's are written, and up to 31 columns on its left, for transform
  /// blocks are decoded whole. Returns what was written; each of these pixels is the one that
  /// the whole picture has there.
  ///
  /// What it costs: transforms run for the region alone, and what lies below it is not looked at.
  /// The bits of the region's rows are parsed, and of all rows above, for a JPEG has no index; but
  /// where it has restart markers, only from the last one above the region. What is not parsed may
  /// be cut off or damaged without harm. (A progressive JPEG is read to its end.)
  ///
  /// Nothing: not a JPEG, of another size, cut off or damaged, or of a kind that cannot be cropped
  /// (luminance stored coarser than chrominance). Then the region's pixels are undefined.
  std::optional<Region> decode(std::span<const std::uint8_t> jpeg, const Region& region,
                               std::uint8_t* luma) noexcept;

 private:
  struct State;
  std::unique_ptr<State> state_;
  int width_;
  int height_;
};

// Restart markers (ITU-T T.81, B.1.1.3 and E.1.4): where a JPEG's entropy-coded data can be entered
// without parsing what comes before. Many webcams send them. Pure.

/// `data` begins with the first entropy-coded byte of a scan. Returns the offset of the first byte
/// after `count` restart markers; nothing if the data ends before, or if the markers do not count
/// RST0, RST1 ... RST7, RST0 ... as they should.
std::optional<std::size_t> after_restart_markers(std::span<const std::uint8_t> data,
                                                 std::int64_t count) noexcept;

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
