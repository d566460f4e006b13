// Arithmetic on board time, which wraps after 71.6 min.
#pragma once

#include <stdint.h>

namespace tagwrench {
namespace firmware {

/// For times less than 35 min apart.
constexpr bool reached(uint32_t now_us, uint32_t at_us) {
  return static_cast<int32_t>(now_us - at_us) >= 0;
}

}  // namespace firmware
}  // namespace tagwrench
