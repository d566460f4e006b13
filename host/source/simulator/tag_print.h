// A tag as it comes out of the printer and off the scissors.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "host/source/simulator/scenario.h"
#include "host/source/simulator/texture.h"

namespace tagwrench::sim {

/// The cells of a tag, black frame included, row by row as printed: true = black.
struct TagCells {
  int across = 0;
  std::vector<bool> black;
  bool is_black(int column, int row) const {
    return black[static_cast<std::size_t>(row * across + column)];
  }
};

/// Families as in sensor.yaml: aruco_original, aruco_4x4_50 ... apriltag_36h11, grid_10x10.
bool family_exists(const std::string& family);
/// Number of ids in a family.
int family_size(const std::string& family);
TagCells tag_cells(const std::string& family, int id);

/// Paper and ink; every edge at its exact place (area coverage), moved only by ink spread and
/// roughness.
Texture print_tag(const Target& target, const TagCells& cells, double texels_per_m,
                  std::uint64_t seed);

}  // namespace tagwrench::sim
