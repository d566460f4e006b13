// What the core asks of the page that runs it, and gets at once: its libraries' work. core.ts
// answers.
#pragma once

#include <cstddef>
#include <cstdint>

namespace tagwrench {

/// 32 bytes into `digest`.
void page_sha256(const std::uint8_t* bytes, std::size_t count, std::uint8_t* digest);

/// The counts of a 16-bit grey PNG file of this size; false for every other file.
bool page_decode_png(const std::uint8_t* bytes, std::size_t count, int width, int height,
                     std::uint16_t* grey);

/// Most squares of a kind that are taken from the page.
constexpr int kMaxPageSquares = 512;

struct PageSquares {
  std::int32_t tags = 0;
  std::int32_t others = 0;
  std::int32_t id[kMaxPageSquares];
  float tag_corners[kMaxPageSquares][8];  ///< x, y of each, px
  float other_corners[kMaxPageSquares][8];
};

enum class PageLook : std::int32_t { found = 0, no_finder = 1, refused = 2 };

/// Looks for squares in an image without padding. `family`: a tag family's name.
PageLook page_find_squares(const std::uint8_t* pixels, int width, int height, const char* family,
                           bool sharpen, PageSquares& squares);

}  // namespace tagwrench
