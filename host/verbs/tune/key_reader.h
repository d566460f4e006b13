// Bytes of a terminal -> keys.
#pragma once

#include <string_view>
#include <vector>

namespace tagwrench {

struct Key {
  enum class Kind : unsigned char { character, up, down, left, right, enter, erase, escape, stop };
  Kind kind = Kind::character;
  char character = 0;  ///< printable ASCII
};

/// The keys in what one read() has brought. Others than those above are left out.
std::vector<Key> keys_in(std::string_view bytes);

}  // namespace tagwrench
