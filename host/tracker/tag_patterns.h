// The cells of a tag as printed. Uses OpenCV inside, for its tables of bits.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "host/tracker/edges.h"
#include "host/tracker/target.h"

namespace tagwrench {

/// The tag of this id, `size` (edge of the black square) and `border` (white margin) in m. The id
/// must be one of the family's: 0 to id_count(family) - 1.
TagPattern tag_pattern(TagFamily family, int id, double size, double border);

/// The id of the family's tag with exactly these cells inside its border, row by row, 1 white,
/// turned any way. There must be bits_per_side(family) squared of them.
std::optional<int> identify_tag(TagFamily family, const std::vector<std::uint8_t>& white);

}  // namespace tagwrench
