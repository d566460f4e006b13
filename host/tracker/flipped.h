// An image, left and right exchanged.
#pragma once

#include <algorithm>
#include <cstdint>
#include <vector>

#include "host/core/types.h"

namespace tagwrench {

class FlippedImage {
 public:
  explicit FlippedImage(const ImageView& image)
      : width_(image.width),
        height_(image.height),
        pixels_(static_cast<std::size_t>(image.width) * static_cast<std::size_t>(image.height)) {
    for (int row = 0; row < height_; ++row) {
      const std::uint8_t* from = image.pixels + static_cast<std::ptrdiff_t>(row) * image.stride;
      std::reverse_copy(from, from + width_,
                        pixels_.begin() + static_cast<std::ptrdiff_t>(row) * width_);
    }
  }
  ImageView view() const noexcept { return {pixels_.data(), width_, height_, width_}; }

 private:
  int width_;
  int height_;
  std::vector<std::uint8_t> pixels_;
};

}  // namespace tagwrench
