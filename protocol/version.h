// Which side must be updated for two versions of the protocol to understand each other.
#pragma once

#include <stdint.h>

namespace tagwrench {
namespace link {

enum class Update : uint8_t {
  none,   ///< same major: the one with the lower minor does without what was added since
  board,  ///< its firmware is too old for this host
  host,   ///< it is too old for this firmware
};

constexpr Update needed_update(uint8_t host_major, uint8_t board_major) {
  return board_major == host_major  ? Update::none
         : board_major < host_major ? Update::board
                                    : Update::host;
}

}  // namespace link
}  // namespace tagwrench
