// An image of a board's flash as Intel HEX, as far as it is looked at before it is flashed.
#pragma once

#include <string_view>

namespace tagwrench {

/// Whether all lines are records with the right sum, up to the one that ends the file (Intel,
/// "Hexadecimal Object File Format Specification", 1988). Half an image would be worse than none.
bool is_whole_hex_image(std::string_view text);

}  // namespace tagwrench
