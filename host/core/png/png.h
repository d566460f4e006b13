// Grey levels of a PNG file (ISO/IEC 15948). What is damaged is told by the return value alone:
// nothing is printed.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace tagwrench {

struct PngHeader {
  std::uint32_t width = 0;
  std::uint32_t height = 0;
  int bit_depth = 0;  ///< of each channel, or of the palette's index
  bool grey = false;  ///< one channel of grey, no alpha
};

/// From the first chunk. Empty where the bytes are no PNG or end before it does.
std::optional<PngHeader> png_header(std::span<const std::uint8_t> bytes) noexcept;

/// Row by row, no padding; of colours the luminance (ITU-R BT.601), of 16 bits the upper eight.
/// False, with `grey` undefined, where the file is damaged, ends early or is not of this size.
bool decode_png(std::span<const std::uint8_t> bytes, int width, int height,
                std::vector<std::uint8_t>& grey);

/// The counts of a 16-bit grey file; false for every other kind too.
bool decode_png(std::span<const std::uint8_t> bytes, int width, int height,
                std::vector<std::uint16_t>& grey);

// Grey levels as a PNG file (ISO/IEC 15948).

/// Of `width` x `height` grey levels, row by row, no padding. Throws std::runtime_error if it
/// cannot be done (out of memory, a size of nothing).
std::vector<std::uint8_t> encode_png(const std::uint8_t* grey, int width, int height);

/// 16 bits per pixel.
std::vector<std::uint8_t> encode_png(const std::uint16_t* grey, int width, int height);

}  // namespace tagwrench
