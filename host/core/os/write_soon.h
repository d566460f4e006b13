// Text for a stream that may be stuck.
#pragma once

#include <chrono>
#include <string_view>

namespace tagwrench {

/// Waits for room no longer than `patience` in all, and never in the write itself; false: not all
/// of it was written. Does not change how others see the stream.
bool write_soon(int fd, std::string_view text, std::chrono::milliseconds patience) noexcept;

}  // namespace tagwrench
