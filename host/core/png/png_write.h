// Grey levels as a PNG file (ISO/IEC 15948).
#pragma once

#include <cstdint>
#include <vector>

namespace tagwrench {

/// Of `width` x `height` grey levels, row by row, no padding. Throws std::runtime_error if it
/// cannot be done (out of memory, a size of nothing).
std::vector<std::uint8_t> encode_png(const std::uint8_t* grey, int width, int height);

/// 16 bits per pixel.
std::vector<std::uint8_t> encode_png(const std::uint16_t* grey, int width, int height);

}  // namespace tagwrench
