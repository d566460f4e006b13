// Single keys from the terminal, or from a program that presses them, while a calibration runs.
#pragma once

#include <termios.h>

#include <cstdint>

namespace tagwrench {

/// Where standard input is a terminal: keys come without Return, and are not shown. Everything is
/// put back at the end.
class Keys {
 public:
  enum class From : std::uint8_t {
    terminal,
    program,  ///< standard input is a pipe, a byte a key
  };

  explicit Keys(From from) noexcept;
  Keys(const Keys&) = delete;
  Keys& operator=(const Keys&) = delete;
  ~Keys();

  bool there() const noexcept { return there_; }
  /// -1 where there are no keys.
  int poll_fd() const noexcept;
  /// The next key; 0 if none was pressed. Never blocks.
  char next() noexcept;

 private:
  bool there_ = false;
  bool changed_ = false;  ///< the terminal
  termios before_{};
};

}  // namespace tagwrench
