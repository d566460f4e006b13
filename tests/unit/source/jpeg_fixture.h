// JPEGs made on the spot by libturbojpeg's compressor, so that the tests carry no binary files.
#pragma once

#include <turbojpeg.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <random>
#include <vector>

namespace tagwrench {

/// A smooth pattern with some noise, so that the entropy-coded part is long.
inline std::vector<std::uint8_t> pattern(int width, int height) {
  std::mt19937 random(7);
  std::uniform_int_distribution<int> noise(-9, 9);
  std::vector<std::uint8_t> pixels(static_cast<std::size_t>(width) *
                                   static_cast<std::size_t>(height));
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const double value = 128 + 60 * std::sin(0.21 * x) + 40 * std::cos(0.13 * y) + noise(random);
      pixels[static_cast<std::size_t>(y) * static_cast<std::size_t>(width) +
             static_cast<std::size_t>(x)] =
          static_cast<std::uint8_t>(std::clamp(value, 0.0, 255.0));
    }
  }
  return pixels;
}

/// Colour (4:2:2, as webcams send) from grey pixels.
inline std::vector<std::uint8_t> jpeg_of(const std::vector<std::uint8_t>& grey, int width,
                                         int height) {
  std::vector<std::uint8_t> rgb;
  for (const std::uint8_t value : grey) rgb.insert(rgb.end(), 3, value);
  tjhandle handle = tjInitCompress();
  unsigned char* data = nullptr;
  unsigned long size = 0;
  tjCompress2(handle, rgb.data(), width, 0, height, TJPF_RGB, &data, &size, TJSAMP_422, 90, 0);
  std::vector<std::uint8_t> jpeg(data, data + size);
  tjFree(data);
  tjDestroy(handle);
  return jpeg;
}

/// The same file without its DHT segments (marker FF C4), as many webcams send it.
inline std::vector<std::uint8_t> without_huffman_tables(const std::vector<std::uint8_t>& jpeg) {
  std::vector<std::uint8_t> out(jpeg.begin(), jpeg.begin() + 2);
  std::size_t at = 2;
  while (at + 4 <= jpeg.size()) {
    const std::size_t length = 2 + (static_cast<std::size_t>(jpeg[at + 2]) << 8 | jpeg[at + 3]);
    const auto begin = jpeg.begin() + static_cast<std::ptrdiff_t>(at);
    if (jpeg[at + 1] == 0xDA) {  // start of scan: the rest is data
      out.insert(out.end(), begin, jpeg.end());
      return out;
    }
    if (jpeg[at + 1] != 0xC4)
      out.insert(out.end(), begin, begin + static_cast<std::ptrdiff_t>(length));
    at += length;
  }
  return out;
}

}  // namespace tagwrench
