#include "host/commands/calibrate_wrench/keys.h"

#include <poll.h>
#include <unistd.h>

namespace tagwrench {

Keys::Keys(From from) noexcept {
  if (from == From::program) {
    there_ = true;
    return;
  }
  // A program in the background would be stopped for touching the terminal.
  if (::isatty(STDIN_FILENO) == 0 || ::tcgetpgrp(STDIN_FILENO) != ::getpgrp()) return;
  if (::tcgetattr(STDIN_FILENO, &before_) != 0) return;
  termios raw = before_;
  raw.c_lflag &= ~static_cast<tcflag_t>(ICANON | ECHO);
  raw.c_cc[VMIN] = 0;
  raw.c_cc[VTIME] = 0;
  there_ = changed_ = ::tcsetattr(STDIN_FILENO, TCSANOW, &raw) == 0;
}

Keys::~Keys() {
  if (changed_) ::tcsetattr(STDIN_FILENO, TCSANOW, &before_);
}

int Keys::poll_fd() const noexcept { return there_ ? STDIN_FILENO : -1; }

char Keys::next() noexcept {
  if (!there_) return 0;
  pollfd entry{STDIN_FILENO, POLLIN, 0};
  char key = 0;
  if (::poll(&entry, 1, 0) <= 0) return 0;
  if (::read(STDIN_FILENO, &key, 1) == 1) return key;
  there_ = changed_ = false;  // the terminal, or the program, is gone
  return 0;
}

}  // namespace tagwrench
