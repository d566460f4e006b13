// Frames as they came, of whatever format, to luminance: what replays a folder or a recording. The
// bytes come from files and are not trusted.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "host/core/types.h"

namespace tagwrench {

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
  RawDecoder(int width, int height);
  ~RawDecoder();
  RawDecoder(const RawDecoder&) = delete;
  RawDecoder& operator=(const RawDecoder&) = delete;

  /// Fills `image` and `decoded` of the frame, at least the `wanted` part (empty: all); the pixels
  /// are the very ones that the source of `raw` delivered. PNG and PGM are decoded whole. `raw`
  /// must outlive the frame, which is valid until the next call. Decoding the same bytes again with
  /// more wanted leaves what was readable as it was. False: unknown format, damaged, or of another
  /// size.
  bool decode(const RawFrame& raw, const Region& wanted, Frame& frame) noexcept;

 private:
  struct State;  ///< keeps the picture libraries out of this header
  std::unique_ptr<State> state_;
};

}  // namespace tagwrench
