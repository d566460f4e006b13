// The pseudo-random light pattern: bit k shines from start + k * period on. A maximal-length
// sequence of 2^15 - 1 bits, in which any 15 neighbours occur once; so a picture or two tell when
// they were taken.
#pragma once

#include <stdint.h>

namespace tagwrench {
namespace link {

constexpr uint16_t kPatternBits = 32767;  ///< then it repeats

/// The register after `state` (1..32767): Fibonacci register, x^15 + x^14 + 1. The light is on
/// where bit 0 is set.
constexpr uint16_t next_pattern_state(uint16_t state) {
  return static_cast<uint16_t>(((state << 1) | (((state >> 14) ^ (state >> 13)) & 1)) & 0x7FFF);
}

constexpr bool pattern_light(uint16_t state) { return (state & 1) != 0; }

}  // namespace link
}  // namespace tagwrench
