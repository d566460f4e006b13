// What the core asks of the page that runs it, and gets at once: its libraries' work, in the places
// of sha256.cpp, png.cpp, tag_dictionary.cpp and tag_patterns.cpp. core.ts answers.
#include <emscripten.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <string>

#include "host/core/grid_tags.h"
#include "host/core/png/png.h"
#include "host/core/sha256.h"
#include "host/tracker/acquire.h"
#include "host/tracker/target.h"
#include "tag_bits.inc"

// `Module.page` is the object that core.ts hands in when it loads the core.
// clang-format off
EM_JS(void, page_sha256, (const std::uint8_t* bytes, std::size_t count, std::uint8_t* digest), {
  HEAPU8.set(Module['page'].sha256(HEAPU8.subarray(bytes, bytes + count)), digest);
});
EM_JS(int, page_decode_png, (const std::uint8_t* bytes, std::size_t count, int width, int height, std::uint16_t* grey), {
  const counts = Module['page'].decodePng(HEAPU8.subarray(bytes, bytes + count), width, height);
  if (!counts || counts.length !== width * height) return 0;
  HEAPU16.set(counts, grey >> 1);
  return 1;
});
EM_JS(int, page_find_squares, (const std::uint8_t* pixels, int width, int height, const char* family, int sharpen, int most,
                                         std::int32_t* counts, std::int32_t* ids, float* tags, float* others), {
  const finder = Module['page'].finder;
  if (!finder) return 1;
  let found;
  try {
    found = finder.find(HEAPU8.subarray(pixels, pixels + width * height), width, height, UTF8ToString(family), !!sharpen);
  } catch (error) {
    return 2;
  }
  const tagCount = Math.min(found.ids.length, most);
  const otherCount = Math.min(found.others.length / 8, most);
  HEAP32.set(found.ids.subarray(0, tagCount), ids >> 2);
  HEAPF32.set(found.tags.subarray(0, 8 * tagCount), tags >> 2);
  HEAPF32.set(found.others.subarray(0, 8 * otherCount), others >> 2);
  HEAP32[counts >> 2] = tagCount;
  HEAP32[(counts >> 2) + 1] = otherCount;
  return 0;
});
// clang-format on

namespace tagwrench {
namespace {

constexpr int kNoFinder = 1;
constexpr int kMaxSquares = 512;  ///< of a kind, that are taken from the page

std::vector<Square> squares_of(const float (*corners)[8], int count) {
  std::vector<Square> out(static_cast<std::size_t>(count));
  for (Square& square : out) {
    for (std::size_t c = 0; c < 4; ++c) square[c] = {(*corners)[2 * c], (*corners)[2 * c + 1]};
    ++corners;
  }
  return out;
}

/// From a table that the build makes with the program's.
bool is_white_cell(TagFamily family, int id, int row, int column) {
  if (family == TagFamily::grid_10x10) return grid_is_white(id, row, column);
  const int bits = bits_per_side(family);
  const std::uint64_t tag = kTagBits[static_cast<std::size_t>(family)][id];
  return (tag >> (bits * bits - 1 - (row * bits + column)) & 1) != 0;
}

}  // namespace

std::string sha256_hex(std::span<const std::uint8_t> bytes) {
  constexpr std::string_view kDigits = "0123456789abcdef";
  std::array<std::uint8_t, 32> digest{};
  page_sha256(bytes.data(), bytes.size(), digest.data());
  std::string out;
  for (const std::uint8_t byte : digest) {
    out += kDigits[byte >> 4];
    out += kDigits[byte & 15];
  }
  return out;
}

std::string sha256_hex(std::string_view text) {
  return sha256_hex(std::span(reinterpret_cast<const std::uint8_t*>(text.data()), text.size()));
}

/// ISO/IEC 15948, 5.2 and 11.2.2: the signature, then the chunk IHDR.
std::optional<PngHeader> png_header(std::span<const std::uint8_t> bytes) noexcept {
  constexpr std::array<std::uint8_t, 16> kStart = {0x89, 'P', 'N', 'G', '\r', '\n', 0x1a, '\n',
                                                   0,    0,   0,   13,  'I',  'H',  'D',  'R'};
  constexpr std::size_t kHeader = kStart.size() + 13 + 4;  // its 13 bytes and their check sum
  if (bytes.size() < kHeader || !std::equal(kStart.begin(), kStart.end(), bytes.begin()))
    return std::nullopt;
  const auto number = [&bytes](std::size_t at) {
    return std::uint32_t{bytes[at]} << 24 | std::uint32_t{bytes[at + 1]} << 16 |
           std::uint32_t{bytes[at + 2]} << 8 | bytes[at + 3];
  };
  PngHeader header{number(16), number(20), bytes[24], bytes[25] == 0};
  if (header.width == 0 || header.height == 0) return std::nullopt;
  return header;
}

bool decode_png(std::span<const std::uint8_t> bytes, int width, int height,
                std::vector<std::uint16_t>& grey) {
  grey.resize(static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
  return page_decode_png(bytes.data(), bytes.size(), width, height, grey.data()) != 0;
}

struct SquareFinder::Library {
  std::string family;
  std::vector<std::uint8_t> packed;  ///< the image without padding
  std::int32_t count[2] = {0, 0};    ///< tags, other squares
  std::int32_t id[kMaxSquares];
  float tag_corners[kMaxSquares][8];  ///< x, y of each, px
  float other_corners[kMaxSquares][8];
};

SquareFinder::SquareFinder(TagFamily family) : library_(std::make_unique<Library>()) {
  library_->family = name(family);
}

SquareFinder::~SquareFinder() = default;

std::optional<SquareList> SquareFinder::find(const ImageView& image, bool sharpen) {
  const auto width = static_cast<std::size_t>(image.width);
  library_->packed.resize(width * static_cast<std::size_t>(image.height));
  for (int row = 0; row < image.height; ++row) {
    const std::uint8_t* from = image.pixels + static_cast<std::ptrdiff_t>(row) * image.stride;
    std::copy(from, from + width,
              library_->packed.begin() + static_cast<std::ptrdiff_t>(row) * image.width);
  }
  Library& found = *library_;
  const int trouble = page_find_squares(
      found.packed.data(), image.width, image.height, found.family.c_str(), sharpen ? 1 : 0,
      kMaxSquares, found.count, found.id, &found.tag_corners[0][0], &found.other_corners[0][0]);
  if (trouble == kNoFinder) return std::nullopt;
  if (trouble != 0) return SquareList{};
  return SquareList{{found.id, found.id + found.count[0]},
                    squares_of(found.tag_corners, found.count[0]),
                    squares_of(found.other_corners, found.count[1])};
}

TagPattern tag_pattern(TagFamily family, int id, double size, double border) {
  const int bits = bits_per_side(family);
  TagPattern pattern;
  pattern.id = id;
  pattern.cells = bits + 2;
  pattern.size = size;
  pattern.border = border;
  pattern.white.assign(static_cast<std::size_t>(pattern.cells * pattern.cells), 0);
  for (int row = 0; row < bits; ++row) {
    for (int column = 0; column < bits; ++column)
      if (is_white_cell(family, id, row, column))
        pattern.white[static_cast<std::size_t>((row + 1) * pattern.cells + column + 1)] = 1;
  }
  return pattern;
}

std::optional<int> identify_tag(TagFamily family, const std::vector<std::uint8_t>& white) {
  const int bits = bits_per_side(family);
  const int last = bits - 1;
  const auto is = [&](int id, int turns) {
    for (int row = 0; row < bits; ++row) {
      for (int column = 0; column < bits; ++column) {
        const int r[] = {row, column, last - row, last - column};
        const int c[] = {column, last - row, last - column, row};
        const bool here = white[static_cast<std::size_t>(r[turns] * bits + c[turns])] != 0;
        if (here != is_white_cell(family, id, row, column)) return false;
      }
    }
    return true;
  };
  for (int id = 0; id < id_count(family); ++id) {
    for (int turns = 0; turns < 4; ++turns)
      if (is(id, turns)) return id;
  }
  return std::nullopt;
}

}  // namespace tagwrench
