#include "host/board/board_link.h"

#include <fmt/format.h>
#include <sys/epoll.h>
#include <sys/random.h>
#include <sys/timerfd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <system_error>

namespace tagwrench::link {
namespace {

constexpr int kMaxReads = 4;  ///< in one service(): the frame loop goes first

TimePoint clock_now() { return std::chrono::steady_clock::now(); }

std::string path_of(const std::string& port, const std::optional<UsbIdentity>& identity,
                    const std::string& option) {
  if (identity) return find_usb_port(*identity, option);
  return port.empty() ? only_port(option) : port;
}

UniqueFd checked(int fd, const char* what) {
  if (fd < 0) throw std::system_error(errno, std::generic_category(), what);
  return UniqueFd(fd);
}

void watch(int epoll, int fd) {
  epoll_event event{};
  event.events = EPOLLIN;
  event.data.fd = fd;
  ::epoll_ctl(epoll, EPOLL_CTL_ADD, fd, &event);
}

}  // namespace

BoardSessionOptions new_session() {
  BoardSessionOptions out;
  out.new_id.count = kIdBytes;
  if (::getrandom(&out.session, sizeof out.session, 0) != sizeof out.session ||
      ::getrandom(out.new_id.bytes, sizeof out.new_id.bytes, 0) != sizeof out.new_id.bytes)
    throw std::system_error(errno, std::generic_category(), "getrandom");
  out.session |= 1;  // 0 stands for no host
  return out;
}

BoardLink::BoardLink(const std::string& port, const BoardSessionOptions& options, unsigned baud,
                     const std::string& option)
    : identity_(parse_usb_identity(port, option)),
      baud_(baud),
      session_(options),
      epoll_(checked(::epoll_create1(EPOLL_CLOEXEC), "epoll")),
      timer_(checked(::timerfd_create(CLOCK_MONOTONIC, TFD_CLOEXEC | TFD_NONBLOCK), "timerfd")) {
  path_ = path_of(port, identity_, option);
  serial_ = SerialPort(path_, baud_, option);
  watch(epoll_.get(), timer_.get());
  watch_serial();
  arm(clock_now());
}

void BoardLink::watch_serial() noexcept {
  mark_.set(path_.c_str());
  watch(epoll_.get(), serial_.fd());
}

void BoardLink::service() noexcept {
  if (clock_now() >= armed_) {
    std::uint64_t expirations = 0;
    [[maybe_unused]] const ssize_t taken = ::read(timer_.get(), &expirations, sizeof expirations);
    armed_ = TimePoint::max();
  }
  if (serial_) receive();
  if (!serial_) try_again(clock_now());
  send();
}

void BoardLink::send() noexcept {
  if (!serial_) return arm(next_try_);
  std::array<std::uint8_t, BoardSession::kMaxBytesOut> out;
  const std::size_t count = session_.poll(clock_now(), out.data());
  if (count > 0 && !serial_.write({out.data(), count})) lost();
  arm(serial_ ? session_.next_poll() : next_try_);
}

void BoardLink::receive() noexcept {
  std::array<std::uint8_t, 4096> room;
  for (int i = 0; i < kMaxReads; ++i) {
    const SerialPort::ReadResult got = serial_.read(room);
    if (got.gone) return lost();
    if (got.count == 0) return;
    session_.take({room.data(), got.count}, clock_now());
    if (got.count < room.size()) return;
  }
}

void BoardLink::lost() noexcept {
  serial_.close();
  session_.reconnect();
  news_.push({BoardEvent::Kind::unplugged, 0, 0});
  next_try_ = clock_now() + kRetryPeriod;
}

void BoardLink::try_again(TimePoint now) noexcept {
  if (now < next_try_) return;
  next_try_ = now + kRetryPeriod;
  try {
    if (identity_) {
      const std::vector<std::string> nodes = usb_serial_nodes(*identity_);
      if (nodes.empty()) return;
      path_ = nodes.front();
    }
  } catch (...) {
    return;  // sysfs changed while it was read: at the next try
  }
  if (!mark_.may_reopen(path_.c_str()) || serial_.open(path_.c_str(), baud_)) return;
  watch_serial();
  session_.reconnect();
  news_.push({BoardEvent::Kind::plugged, 0, 0});
}

void BoardLink::arm(TimePoint when) noexcept {
  if (when == armed_) return;
  armed_ = when;
  const auto ns = std::chrono::duration_cast<Duration>(when.time_since_epoch()).count();
  const std::int64_t at = std::max<std::int64_t>(ns, 1);  // zero would disarm it
  const itimerspec timer{{0, 0}, {at / 1'000'000'000, at % 1'000'000'000}};
  ::timerfd_settime(timer_.get(), TFD_TIMER_ABSTIME, &timer, nullptr);
}

std::string BoardLink::why_no_board() const {
  const SessionCounters counters = session_.counters();
  if (counters.bytes == 0) {
    return fmt::format(
        "{}: nothing answers; if this is the board, put the firmware on it: `tagwrench board "
        "flash`",
        path_);
  }
  if (counters.frames > 0) {
    return fmt::format(
        "{}: {} frames came, but no answer to the greeting; disconnect the board and plug it in "
        "again",
        path_, counters.frames);
  }
  std::string hex;
  std::string plain;
  for (const std::uint8_t byte :
       session_.first_bytes().first(std::min<std::size_t>(session_.first_bytes().size(), 16))) {
    hex += fmt::format("{:02x} ", byte);
    plain += byte >= 0x20 && byte < 0x7F ? static_cast<char>(byte) : '.';
  }
  return fmt::format(
      "{}: {} bytes came, but no frame of a tagwrench board: {}({}); another device, or one that "
      "does not speak {} baud",
      path_, counters.bytes, hex, plain, baud_);
}

}  // namespace tagwrench::link
