// A line for people, on standard error.
#pragma once

#include <fmt/format.h>

#include <chrono>
#include <string_view>
#include <utility>

namespace tagwrench {

/// As printable(), on one line. Never throws and hardly waits: a terminal that is closed, or
/// stopped with Ctrl-S, or a pipe that nobody reads must not end or stall an instrument. What finds
/// no room in 20 ms is lost.
void log_info(std::string_view line) noexcept;
template <typename First, typename... Rest>
void log_info(fmt::format_string<First, Rest...> text, First&& first, Rest&&... rest) {
  log_info(fmt::format(text, std::forward<First>(first), std::forward<Rest>(rest)...));
}

// Text for a stream that may be stuck.

/// Waits for room no longer than `patience` in all, and never in the write itself; false: not all
/// of it was written. Does not change how others see the stream.
bool write_soon(int fd, std::string_view text, std::chrono::milliseconds patience) noexcept;

}  // namespace tagwrench
