#include "host/board/serial_port.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <linux/major.h>
#include <linux/serial.h>
#include <sys/file.h>
#include <sys/ioctl.h>
#include <sys/stat.h>
#include <sys/sysmacros.h>
#include <termios.h>

#include <array>
#include <cerrno>
#include <cstring>
#include <utility>

#include "host/core/config_error.h"

namespace tagwrench::link {
namespace {

constexpr std::array<std::pair<unsigned, speed_t>, 6> kBauds{{{115200, B115200},
                                                              {230400, B230400},
                                                              {500000, B500000},
                                                              {921600, B921600},
                                                              {1000000, B1000000},
                                                              {2000000, B2000000}}};

bool is_pseudo(const struct stat& device) {
  const unsigned number = major(device.st_rdev);
  return number >= UNIX98_PTY_SLAVE_MAJOR &&
         number < UNIX98_PTY_SLAVE_MAJOR + UNIX98_PTY_MAJOR_COUNT;
}

speed_t speed_of(unsigned baud) {
  for (const auto& [rate, speed] : kBauds) {
    if (rate == baud) return speed;
  }
  return B0;
}

bool set_raw(int fd, speed_t speed) {
  termios settings{};
  if (tcgetattr(fd, &settings) != 0) return false;
  cfmakeraw(&settings);
  settings.c_cflag |= CLOCAL | CREAD;
  // HUPCL would drop DTR at the end, and the next opening would reset an Arduino once more.
  settings.c_cflag &= ~static_cast<tcflag_t>(CRTSCTS | CSTOPB | HUPCL);
  settings.c_cc[VMIN] = 1;
  settings.c_cc[VTIME] = 0;
  cfsetispeed(&settings, speed);
  cfsetospeed(&settings, speed);
  if (tcsetattr(fd, TCSANOW, &settings) != 0) return false;
  // It succeeds if anything at all could be set.
  termios now{};
  return tcgetattr(fd, &now) == 0 && cfgetospeed(&now) == speed;
}

/// Adapters that collect bytes for 16 ms (FTDI) do it for 1 ms then; the others do not know it.
void ask_for_low_latency(int fd) {
  serial_struct about{};
  if (::ioctl(fd, TIOCGSERIAL, &about) != 0) return;
  about.flags |= ASYNC_LOW_LATENCY;
  ::ioctl(fd, TIOCSSERIAL, &about);
}

SerialFailure failure_of(int error) {
  using Kind = SerialFailure::Kind;
  switch (error) {
    case ENOENT:
    case ENODEV:
    case ENXIO:
    case ENOTDIR:
      return {Kind::absent, error};
    case EACCES:
    case EPERM:
      return {Kind::denied, error};
    case EBUSY:
    case EWOULDBLOCK:
      return {Kind::busy, error};
    case ENOTTY:
    case EISDIR:
      return {Kind::no_serial_port, error};
    default:
      return {Kind::other, error};
  }
}

}  // namespace

SerialPort::SerialPort(const std::string& path, unsigned baud, const std::string& option) {
  if (const SerialFailure failure = open(path.c_str(), baud))
    throw ConfigError(text(failure, path, baud, option));
}

SerialFailure SerialPort::open(const char* path, unsigned baud) noexcept {
  fd_.reset();
  struct stat about {};
  if (::stat(path, &about) != 0) return failure_of(errno);
  if (!S_ISCHR(about.st_mode)) return failure_of(ENOTTY);
  UniqueFd fd(::open(path, O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC));
  if (!fd) return failure_of(errno);
  if (!::isatty(fd.get())) return failure_of(ENOTTY);
  if (::flock(fd.get(), LOCK_EX | LOCK_NB) != 0) return failure_of(errno);
  // Keeps programs out that know no locks. A pseudo-terminal would stay exclusive after its
  // closing.
  if (!is_pseudo(about)) ::ioctl(fd.get(), TIOCEXCL);
  const speed_t speed = speed_of(baud);
  if (speed == B0 || !set_raw(fd.get(), speed)) return {SerialFailure::Kind::no_such_baud, 0};
  ask_for_low_latency(fd.get());
  tcflush(fd.get(), TCIOFLUSH);
  fd_ = std::move(fd);
  return {};
}

SerialPort::ReadResult SerialPort::read(std::span<std::uint8_t> room) noexcept {
  if (!fd_) return {0, true};
  const ssize_t count = ::read(fd_.get(), room.data(), room.size());
  if (count > 0) return {static_cast<std::size_t>(count), false};
  if (count < 0 && (errno == EAGAIN || errno == EINTR)) return {};
  close();
  return {0, true};
}

bool SerialPort::write(std::span<const std::uint8_t> bytes) noexcept {
  if (!fd_) return false;
  const ssize_t count = ::write(fd_.get(), bytes.data(), bytes.size());
  if (count < 0 && errno != EAGAIN && errno != EINTR) {
    close();
    return false;
  }
  dropped_ += bytes.size() - (count > 0 ? static_cast<std::size_t>(count) : 0);
  return true;
}

void SerialPort::flush_input() noexcept {
  if (fd_) tcflush(fd_.get(), TCIFLUSH);
}

bool TerminalMark::look(const char* path, TerminalMark& mark) noexcept {
  struct stat about {};
  if (::lstat(path, &about) != 0) return false;
  const bool link = S_ISLNK(about.st_mode);
  mark.link_inode_ = link ? about.st_ino : 0;
  mark.link_time_ns_ =
      link ? std::int64_t{about.st_mtim.tv_sec} * 1'000'000'000 + about.st_mtim.tv_nsec : 0;
  return true;
}

void TerminalMark::set(const char* path) noexcept { look(path, *this); }

bool TerminalMark::may_reopen(const char* path) const noexcept {
  struct stat about {};
  TerminalMark now;
  if (::stat(path, &about) != 0 || !look(path, now)) return false;
  if (!is_pseudo(about)) return true;
  return now.link_inode_ != 0 &&
         (now.link_inode_ != link_inode_ || now.link_time_ns_ != link_time_ns_);
}

std::string text(const SerialFailure& failure, const std::string& path, unsigned baud,
                 const std::string& option) {
  using Kind = SerialFailure::Kind;
  switch (failure.kind) {
    case Kind::none:
      return path + ": open";
    case Kind::absent:
      return fmt::format("{}: there is no such port; {}", path, port_advice(option));
    case Kind::denied:
      return fmt::format("{}: no permission; {}", path, permission_advice(path));
    case Kind::busy: {
      const std::string holder = holder_of(path);
      return fmt::format("{}: in use by {}; end it, or give another port with {}", path,
                         holder.empty() ? "another program" : holder, option);
    }
    case Kind::no_serial_port:
      return fmt::format("{}: not a serial port; {}", path, port_advice(option));
    case Kind::no_such_baud:
      return fmt::format("{}: its driver does not do {} baud; use another adapter", path, baud);
    case Kind::other:
      break;
  }
  return fmt::format("{}: cannot be opened: {}; plug it in again", path,
                     std::strerror(failure.error));
}

}  // namespace tagwrench::link
