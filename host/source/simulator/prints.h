// A tag as it comes out of the printer and off the scissors.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "host/source/simulator/disturbances.h"
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

// Dust and scratches on a printed tag.

/// A copy of `clean` (a tag's paper, `tag_size` m along the black square) with dirt on it, placed
/// within the square by `seed`; each `number` elsewhere.
Texture with_dirt(const Texture& clean, const Dirt& dirt, double tag_size, std::uint64_t seed,
                  std::uint64_t number);

// What the camera sees around the tags: a printed plate with spring ends and screws, and the pads
// that carry the tags.

/// The plate, opaque, +-half_x by +-half_y.
Texture print_plate(const Mechanics& mechanics, double half_x, double half_y, double texels_per_m,
                    std::uint64_t seed);

/// One face of the roof under a tag, larger than the tag's paper by `margin`.
Texture print_pad(double half_paper, double margin, double texels_per_m, std::uint64_t seed);

}  // namespace tagwrench::sim
