// The page's likes of tag_pattern() and identify_tag(): from a table that the build makes with the
// program's.
#include <cstdint>

#include "host/core/grid_tags.h"
#include "host/tracker/tag_patterns.h"
#include "tag_bits.inc"

namespace tagwrench {
namespace {

bool is_white_cell(TagFamily family, int id, int row, int column) {
  if (family == TagFamily::grid_10x10) return grid_is_white(id, row, column);
  const int bits = bits_per_side(family);
  const std::uint64_t tag = kTagBits[static_cast<std::size_t>(family)][id];
  return (tag >> (bits * bits - 1 - (row * bits + column)) & 1) != 0;
}

}  // namespace

TagPattern tag_pattern(TagFamily family, int id, double size, double border) {
  const int bits = bits_per_side(family);
  TagPattern pattern;
  pattern.id = id;
  pattern.cells = bits + 2;
  pattern.size = size;
  pattern.border = border;
  pattern.white.assign(static_cast<std::size_t>(pattern.cells * pattern.cells), 0);
  for (int row = 0; row < bits; ++row) {
    for (int column = 0; column < bits; ++column) {
      if (is_white_cell(family, id, row, column))
        pattern.white[static_cast<std::size_t>((row + 1) * pattern.cells + column + 1)] = 1;
    }
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
    for (int turns = 0; turns < 4; ++turns) {
      if (is(id, turns)) return id;
    }
  }
  return std::nullopt;
}

}  // namespace tagwrench
