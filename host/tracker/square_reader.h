// What is printed in a square that the sensor's family does not know: a tag of another family, or
// one that was printed mirrored.
#pragma once

#include <span>
#include <vector>

#include "host/tracker/square_finder.h"

namespace tagwrench {

struct ReadSquare {
  TagFamily family = TagFamily::aruco_original;  ///< the smallest that has this tag
  int id = 0;
  bool mirrored = false;  ///< only of those that are missing
};

/// Reads without any error correction: what is not clearly a tag is left out. `squares` are corners
/// in the image, clockwise, px. Flipped, a tag may read as another one of its family: whether one
/// of `missing` is there mirrored is asked first. Allocates.
std::vector<ReadSquare> read_squares(const ImageView& image, const std::vector<Square>& squares,
                                     TagFamily expected, std::span<const std::int16_t> missing);

}  // namespace tagwrench
