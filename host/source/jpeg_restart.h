// Restart markers (ITU-T T.81, B.1.1.3 and E.1.4): where a JPEG's entropy-coded data can be entered
// without parsing what comes before. Many webcams send them. Pure.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

namespace tagwrench {

/// `data` begins with the first entropy-coded byte of a scan. Returns the offset of the first byte
/// after `count` restart markers; nothing if the data ends before, or if the markers do not count
/// RST0, RST1 ... RST7, RST0 ... as they should.
std::optional<std::size_t> after_restart_markers(std::span<const std::uint8_t> data,
                                                 std::int64_t count) noexcept;

}  // namespace tagwrench
