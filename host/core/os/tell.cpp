#include <unistd.h>

#include <string>

#include "host/core/log.h"

namespace tagwrench {

void log_info(std::string_view line) noexcept {
  try {
    std::string text = "tagwrench: ";
    for (const char c : line) text += c == '\n' || c == '\r' ? ' ' : c;
    text += '\n';
    write_soon(STDERR_FILENO, text, std::chrono::milliseconds(20));
  } catch (...) {
    // Out of memory: there is nobody to tell.
  }
}

}  // namespace tagwrench
