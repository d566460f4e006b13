// JPEG to luminance, the whole picture or only a part of it, through libjpeg-turbo's scanline
// interface. The bytes come from a device and are not trusted.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>

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

}  // namespace tagwrench
