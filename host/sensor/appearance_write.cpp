#include <algorithm>
#include <cmath>
#include <cstdint>
#include <stdexcept>
#include <vector>

#include "host/core/png/png.h"
#include "host/sensor/appearance_file.h"

namespace tagwrench {

std::string encode_reference_image(const ReferenceImage& image) {
  if (image.width <= 0 || image.height <= 0 ||
      image.level.size() !=
          static_cast<std::size_t>(image.width) * static_cast<std::size_t>(image.height)) {
    throw std::invalid_argument("rest image: size and levels do not agree");
  }
  std::vector<std::uint16_t> counts(image.level.size());
  std::transform(image.level.begin(), image.level.end(), counts.begin(), [](float level) {
    return static_cast<std::uint16_t>(
        std::clamp(std::round(level * kReferenceCountsPerLevel), 0.0F, 65535.0F));
  });
  const std::vector<std::uint8_t> bytes = encode_png(counts.data(), image.width, image.height);
  return {bytes.begin(), bytes.end()};
}

}  // namespace tagwrench
