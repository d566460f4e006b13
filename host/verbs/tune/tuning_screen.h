// The terminal while something is tuned: keys as they are pressed, and a screen of its own.
#pragma once

#include <termios.h>

#include <string>
#include <string_view>

namespace tagwrench {

/// On standard input and output. Everything is put back at the end.
class TuningScreen {
 public:
  /// Throws ConfigError: they are no terminal.
  TuningScreen();
  TuningScreen(const TuningScreen&) = delete;
  TuningScreen& operator=(const TuningScreen&) = delete;
  ~TuningScreen();

  int width() const noexcept;
  int height() const noexcept;
  void show(std::string_view screen) noexcept;
  /// What has been typed, if the terminal is readable; empty: it is gone.
  std::string read() noexcept;

 private:
  termios before_{};
};

}  // namespace tagwrench
