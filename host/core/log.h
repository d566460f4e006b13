// A line for people, on standard error.
#pragma once

#include <string_view>

namespace tagwrench {

/// Never throws and hardly waits: a terminal that is closed, or stopped with Ctrl-S, or a pipe that
/// nobody reads must not end or stall an instrument. What finds no room in 20 ms is lost.
void log_info(std::string_view line) noexcept;

}  // namespace tagwrench
