// Frames and commands as an OptoForce sensor sends and gets them, made by the test.
#pragma once

#include <cstdint>
#include <vector>

namespace tagwrench::link {

using Bytes = std::vector<std::uint8_t>;

inline void append16(Bytes& out, unsigned value) {
  out.push_back(static_cast<std::uint8_t>(value >> 8));
  out.push_back(static_cast<std::uint8_t>(value));
}

inline Bytes optoforce_frame(std::uint16_t counter, std::uint16_t status,
                             const std::vector<std::int16_t>& counts) {
  Bytes out{0xAA, 0x07, 0x08, static_cast<std::uint8_t>(4 + 2 * counts.size())};
  append16(out, counter);
  append16(out, status);
  for (const std::int16_t value : counts) append16(out, static_cast<std::uint16_t>(value));
  unsigned sum = 0;
  for (const std::uint8_t byte : out) sum += byte;
  append16(out, sum & 0xFFFF);
  return out;
}

}  // namespace tagwrench::link
