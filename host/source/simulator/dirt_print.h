// Dust and scratches on a printed tag.
#pragma once

#include <cstdint>

#include "host/source/simulator/disturbances.h"
#include "host/source/simulator/texture.h"

namespace tagwrench::sim {

/// A copy of `clean` (a tag's paper, `tag_size` m along the black square) with dirt on it, placed
/// within the square by `seed`; each `number` elsewhere.
Texture with_dirt(const Texture& clean, const Dirt& dirt, double tag_size, std::uint64_t seed,
                  std::uint64_t number);

}  // namespace tagwrench::sim
