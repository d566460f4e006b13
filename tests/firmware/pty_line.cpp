#include "tests/firmware/pty_line.h"

#include <fcntl.h>
#include <poll.h>
#include <stdlib.h>
#include <termios.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstring>
#include <stdexcept>
#include <utility>

#include "firmware/board/pc/port_name.h"
#include "host/core/config_error.h"

namespace tagwrench::emulator {

namespace {

constexpr std::array<std::pair<speed_t, double>, 8> kSpeeds{{{B9600, 9600},
                                                             {B38400, 38400},
                                                             {B57600, 57600},
                                                             {B115200, 115200},
                                                             {B230400, 230400},
                                                             {B500000, 500000},
                                                             {B921600, 921600},
                                                             {B1000000, 1000000}}};

[[noreturn]] void fail(const std::string& what) {
  throw std::runtime_error(what + ": " + std::strerror(errno));
}

}  // namespace

PtyLine::PtyLine(std::string link) : link_(std::move(link)) { plug(); }

void PtyLine::plug() {
  if (plugged()) return;
  UniqueFd master(::posix_openpt(O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC));
  if (!master || ::grantpt(master.get()) != 0 || ::unlockpt(master.get()) != 0)
    fail("cannot make a pseudo terminal");
  std::array<char, 128> name{};
  if (::ptsname_r(master.get(), name.data(), name.size()) != 0) fail("ptsname");
  terminal_ = name.data();
  {
    // Raw from the start; and once opened and closed, it tells that nobody has it open.
    const UniqueFd terminal(::open(name.data(), O_RDWR | O_NOCTTY | O_CLOEXEC));
    termios settings{};
    if (!terminal || ::tcgetattr(terminal.get(), &settings) != 0) fail(terminal_);
    ::cfmakeraw(&settings);
    ::tcsetattr(terminal.get(), TCSANOW, &settings);
  }
  if (!link_.empty()) {
    const std::string wrong = board::take_name(link_, terminal_);
    if (!wrong.empty()) throw ConfigError(wrong);
  }
  master_ = std::move(master);
}

void PtyLine::unplug() {
  if (!plugged()) return;
  if (!link_.empty()) board::leave_name(link_, terminal_);
  master_.reset();
}

bool PtyLine::open() const {
  if (!plugged()) return false;
  pollfd fd{master_.get(), POLLIN, 0};
  return ::poll(&fd, 1, 0) >= 0 && (fd.revents & POLLHUP) == 0;
}

double PtyLine::baud() const {
  termios settings{};
  if (!plugged() || ::tcgetattr(master_.get(), &settings) != 0) return 0;
  for (const auto& [speed, baud] : kSpeeds) {
    if (::cfgetospeed(&settings) == speed) return baud;
  }
  return 0;
}

void PtyLine::disturb(std::vector<std::uint8_t>& bytes) {
  if (bit_errors_ <= 0) return;
  std::bernoulli_distribution flip(bit_errors_);
  for (std::uint8_t& byte : bytes) {
    for (unsigned bit = 0; bit < 8; ++bit) {
      if (flip(random_)) byte = static_cast<std::uint8_t>(byte ^ 1U << bit);
    }
  }
}

void PtyLine::babble(std::size_t count) {
  std::vector<std::uint8_t> bytes(count);
  std::uniform_int_distribution<unsigned> any(0, 255);
  for (std::uint8_t& byte : bytes) byte = static_cast<std::uint8_t>(any(random_));
  write(bytes);
}

std::vector<std::uint8_t> PtyLine::read() {
  std::vector<std::uint8_t> bytes(4096);
  const ssize_t count = plugged() ? ::read(master_.get(), bytes.data(), bytes.size()) : -1;
  bytes.resize(count > 0 ? static_cast<std::size_t>(count) : 0);
  disturb(bytes);
  return bytes;
}

void PtyLine::write(std::span<const std::uint8_t> bytes) {
  if (!plugged() || bytes.empty()) return;
  std::vector<std::uint8_t> sent(bytes.begin(), bytes.end());
  disturb(sent);
  [[maybe_unused]] const ssize_t written = ::write(master_.get(), sent.data(), sent.size());
}

}  // namespace tagwrench::emulator
