// What the camera sees around the tags: a printed plate with spring ends and screws, and the pads
// that carry the tags.
#pragma once

#include "host/source/simulator/scenario.h"
#include "host/source/simulator/texture.h"

namespace tagwrench::sim {

/// The plate, opaque, +-half_x by +-half_y.
Texture print_plate(const Mechanics& mechanics, double half_x, double half_y, double texels_per_m,
                    std::uint64_t seed);

/// One face of the roof under a tag, larger than the tag's paper by `margin`.
Texture print_pad(double half_paper, double margin, double texels_per_m, std::uint64_t seed);

}  // namespace tagwrench::sim
