// A line for people, on standard error.
#pragma once

#include <chrono>
#include <string_view>

namespace tagwrench {

/// Never throws and hardly waits: a terminal that is closed, or stopped with Ctrl-S, or a pipe that
/// nobody reads must not end or stall an instrument. What finds no room in 20 ms is lost.
void log_info(std::string_view line) noexcept;

// Text for a stream that may be stuck.

/// Waits for room no longer than `patience` in all, and never in the write itself; false: not all
/// of it was written. Does not change how others see the stream.
bool write_soon(int fd, std::string_view text, std::chrono::milliseconds patience) noexcept;

}  // namespace tagwrench
