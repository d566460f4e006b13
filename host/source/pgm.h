// Grey levels of a PGM file (netpbm's portable graymap), binary (P5) or plain (P2). Pure.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace tagwrench {

struct PgmHeader {
  std::uint32_t width = 0;
  std::uint32_t height = 0;
  std::uint32_t white = 0;  ///< the largest count, 1 to 65535
  bool plain = false;
  std::size_t size = 0;  ///< bytes before the first pixel
};

/// Empty where the bytes are no PGM, or end before the header does.
std::optional<PgmHeader> pgm_header(std::span<const std::uint8_t> bytes) noexcept;

/// Row by row, no padding, scaled so that white is 255. False, with `grey` undefined, where the
/// file ends early, holds what is no number, or is not of this size.
bool decode_pgm(std::span<const std::uint8_t> bytes, int width, int height,
                std::vector<std::uint8_t>& grey);

}  // namespace tagwrench
