// The size of a picture from its first bytes, so that a whole folder can be checked before the
// first frame.
#pragma once

#include <cstdint>
#include <optional>
#include <span>

namespace tagwrench {

struct ImageSize {
  int width = 0;
  int height = 0;
  bool operator==(const ImageSize&) const = default;
};

/// Of a PNG (ISO/IEC 15948, IHDR), a JPEG (ITU-T T.81, SOFn) or a binary or plain PGM. Nothing
/// where the bytes are none of these or end before the size.
std::optional<ImageSize> image_size(std::span<const std::uint8_t> bytes) noexcept;

}  // namespace tagwrench
