#include "host/verbs/tune/tuning_screen.h"

#include <sys/ioctl.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstdlib>
#include <cstring>

#include "host/config_error.h"

namespace tagwrench {
namespace {

constexpr std::string_view kEnter = "\x1b[?1049h\x1b[?25l";
constexpr std::string_view kLeave = "\x1b[?25h\x1b[?1049l";
constexpr std::string_view kHome = "\x1b[H";

void put(std::string_view text) noexcept {
  while (!text.empty()) {
    const ssize_t written = ::write(STDOUT_FILENO, text.data(), text.size());
    if (written < 0 && errno == EINTR) continue;
    if (written <= 0) return;  // the terminal is gone; read() tells
    text.remove_prefix(static_cast<std::size_t>(written));
  }
}

winsize size_of_terminal() noexcept {
  winsize size{};
  const bool known = ::ioctl(STDOUT_FILENO, TIOCGWINSZ, &size) == 0;
  if (!known || size.ws_col == 0 || size.ws_row == 0) return {24, 80, 0, 0};
  return size;
}

}  // namespace

TuningScreen::TuningScreen() {
  const char* term = std::getenv("TERM");
  const bool dumb = term == nullptr || std::strcmp(term, "dumb") == 0;
  if (::isatty(STDIN_FILENO) == 0 || ::isatty(STDOUT_FILENO) == 0 || dumb ||
      ::tcgetattr(STDIN_FILENO, &before_) != 0)
    throw ConfigError(
        "tagwrench tune: needs a terminal for keys and sliders; elsewhere edit the profile's file, "
        "which is read again when it is saved");
  termios raw = before_;
  // Keys that end or stop a program are keys like others: the terminal is put back first.
  raw.c_lflag &= ~static_cast<tcflag_t>(ICANON | ECHO | ISIG | IEXTEN);
  raw.c_iflag &= ~static_cast<tcflag_t>(IXON | ICRNL | INLCR);
  raw.c_cc[VMIN] = 1;
  raw.c_cc[VTIME] = 0;
  ::tcsetattr(STDIN_FILENO, TCSANOW, &raw);
  put(kEnter);
}

TuningScreen::~TuningScreen() {
  put(kLeave);
  ::tcsetattr(STDIN_FILENO, TCSANOW, &before_);
}

int TuningScreen::width() const noexcept { return size_of_terminal().ws_col; }
int TuningScreen::height() const noexcept { return size_of_terminal().ws_row; }

void TuningScreen::show(std::string_view screen) noexcept {
  put(kHome);
  put(screen);
}

std::string TuningScreen::read() noexcept {
  std::array<char, 256> bytes;
  const ssize_t size = ::read(STDIN_FILENO, bytes.data(), bytes.size());
  if (size <= 0) return {};
  return {bytes.data(), static_cast<std::size_t>(size)};
}

}  // namespace tagwrench
