// A line for people, on standard error. Never throws: a closed terminal must not end an instrument.
#pragma once

#include <unistd.h>

#include <string>
#include <string_view>

namespace tagwrench {

inline void tell(std::string_view line) noexcept {
  try {
    std::string text = "tagwrench: ";
    for (const char c : line) text += c == '\n' || c == '\r' ? ' ' : c;
    text += '\n';
    [[maybe_unused]] const ssize_t written = ::write(STDERR_FILENO, text.data(), text.size());
  } catch (...) {
    // Out of memory: there is nobody to tell.
  }
}

}  // namespace tagwrench
