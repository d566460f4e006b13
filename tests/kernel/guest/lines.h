// What the guest programs have in common: they talk to the checks in lines of text, each with its
// time.
#pragma once

#include <poll.h>
#include <unistd.h>

#include <chrono>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <optional>
#include <string>

namespace tagwrench::rig {

/// CLOCK_MONOTONIC, which libstdc++'s steady_clock reads.
inline std::int64_t now_ns() {
  return std::chrono::nanoseconds(std::chrono::steady_clock::now().time_since_epoch()).count();
}

[[noreturn]] inline void fail(const std::string& why) {
  std::fprintf(stderr, "%s\n", why.c_str());
  std::exit(1);
}

/// Commands on standard input, taken without ever blocking.
class Commands {
 public:
  /// The next whole line that has arrived.
  std::optional<std::string> next() {
    pollfd input{STDIN_FILENO, POLLIN, 0};
    while (text_.find('\n') == std::string::npos && !ended_ && ::poll(&input, 1, 0) > 0) {
      char buffer[256];
      const ssize_t n = ::read(STDIN_FILENO, buffer, sizeof buffer);
      if (n <= 0) {
        ended_ = true;
      } else {
        text_.append(buffer, static_cast<std::size_t>(n));
      }
    }
    const std::size_t end = text_.find('\n');
    if (end == std::string::npos) return std::nullopt;
    std::string line = text_.substr(0, end);
    text_.erase(0, end + 1);
    return line;
  }

  /// Blocks until a line, or the end, may have come.
  void wait() const {
    pollfd input{fd(), POLLIN, 0};
    ::poll(&input, 1, -1);
  }

  /// To poll for; -1, which poll() ignores, once the input has ended.
  int fd() const { return ended_ ? -1 : STDIN_FILENO; }

 private:
  std::string text_;
  bool ended_ = false;
};

}  // namespace tagwrench::rig
