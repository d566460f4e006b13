// Writes the cells of every tag of every family, as the program prints and tracks them, for
// page.cpp: one number a tag, its bits row by row, the first one highest.
#include <cstdint>
#include <cstdio>

#include "host/tracker/target.h"

int main() {
  using namespace tagwrench;
  for (int f = 0; f < kTagFamilies; ++f) {
    const auto family = static_cast<TagFamily>(f);
    if (family == TagFamily::grid_10x10) continue;  // the last; its rows are in grid_tags.h
    std::printf("constexpr std::uint64_t kTagBits%d[] = {", f);
    for (int id = 0; id < id_count(family); ++id) {
      const TagPattern pattern = tag_pattern(family, id, 1, 0);
      std::uint64_t bits = 0;
      for (int row = 1; row + 1 < pattern.cells; ++row)
        for (int column = 1; column + 1 < pattern.cells; ++column)
          bits = bits << 1 | (pattern.is_white(row, column) ? 1 : 0);
      std::printf("%s0x%llx", id == 0 ? "" : ",", static_cast<unsigned long long>(bits));
    }
    std::printf("};\n");
  }
  std::printf("constexpr const std::uint64_t* kTagBits[] = {");
  for (int f = 0; f + 1 < kTagFamilies; ++f) std::printf("%skTagBits%d", f == 0 ? "" : ", ", f);
  std::printf("};\n");
  return std::fflush(stdout) == 0 ? 0 : 1;
}
