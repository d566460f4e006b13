// Pictures as files, and what JPEG does to them.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "host/source/simulator/scenario.h"

namespace tagwrench::sim {

/// The name's ending, dot included.
const char* extension(FileFormat format);

/// Grey levels, row by row, no padding; of a JPEG the quality is 1 to 100 (0: 95). Throws
/// std::runtime_error if the picture cannot be encoded.
std::vector<std::uint8_t> encode_image(const std::uint8_t* pixels, int width, int height,
                                       FileFormat format, int jpeg_quality);

/// Encodes and decodes a picture in place, as a camera with JPEG output and its driver do. Quality
/// 0 does nothing. Throws std::runtime_error if memory is short.
class JpegRoundTrip {
 public:
  JpegRoundTrip(int width, int height, int quality);
  void apply(std::uint8_t* pixels) noexcept;

 private:
  using Coder = std::unique_ptr<void, int (*)(void*)>;
  int width_, height_, quality_;
  Coder encoder_, decoder_;
  std::vector<std::uint8_t> encoded_;
};

}  // namespace tagwrench::sim
