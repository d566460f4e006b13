// Single keys from the terminal, while a calibration runs.
#pragma once

#include <termios.h>

namespace tagwrench {

/// Where standard input is a terminal: keys come without Return, and are not shown. Everything is
/// put back at the end.
class Keys {
 public:
  Keys() noexcept;
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
  termios before_{};
};

}  // namespace tagwrench
