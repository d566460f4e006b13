#include "host/source/jpeg_restart.h"

#include <cstring>

namespace tagwrench {

std::optional<std::size_t> after_restart_markers(std::span<const std::uint8_t> data,
                                                 std::int64_t count) noexcept {
  constexpr std::uint8_t kPrefix = 0xFF, kStuffed = 0x00, kFirst = 0xD0;
  const std::uint8_t* at = data.data();
  const std::uint8_t* const end = at + data.size();
  for (std::int64_t seen = 0; seen < count;) {
    if (at == end) return std::nullopt;
    at = static_cast<const std::uint8_t*>(
        std::memchr(at, kPrefix, static_cast<std::size_t>(end - at)));
    if (at == nullptr || end - at < 2) return std::nullopt;
    const std::uint8_t code = *++at;
    if (code == kPrefix) continue;  // fill bytes may precede a marker
    ++at;
    if (code == kStuffed) continue;
    if (code != kFirst + seen % 8) return std::nullopt;
    ++seen;
  }
  return static_cast<std::size_t>(at - data.data());
}

}  // namespace tagwrench
