#include "host/board/serial_port.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <grp.h>
#include <libusb.h>
#include <linux/major.h>
#include <linux/serial.h>
#include <pwd.h>
#include <sys/file.h>
#include <sys/ioctl.h>
#include <sys/stat.h>
#include <sys/sysmacros.h>
#include <termios.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <memory>
#include <utility>

#include "host/core/config_error.h"
#include "host/core/parse.h"

namespace tagwrench::link {
namespace {

namespace fs = std::filesystem;

bool is_number(const std::string& name) {
  return !name.empty() &&
         std::all_of(name.begin(), name.end(), [](char c) { return c >= '0' && c <= '9'; });
}

bool has_open(const fs::path& process, const struct stat& device) {
  std::error_code error;
  for (fs::directory_iterator it(process / "fd", error), end; !error && it != end;
       it.increment(error)) {
    struct stat about {};
    if (::stat(it->path().c_str(), &about) == 0 && S_ISCHR(about.st_mode) &&
        about.st_rdev == device.st_rdev && about.st_ino == device.st_ino &&
        about.st_dev == device.st_dev)
      return true;
  }
  return false;
}

struct KnownBoard {
  std::uint16_t vendor;
  std::uint16_t product;
  std::string_view name;
};
// Vendor and product ids as in the public list of USB ids.
constexpr KnownBoard kKnown[] = {
    {0x2341, 0x0043, "Arduino Uno R3"},
    {0x2341, 0x0001, "Arduino Uno"},
    {0x2341, 0x0010, "Arduino Mega 2560"},
    {0x2341, 0x8036, "Arduino Leonardo"},
    {0x2a03, 0x0043, "Arduino Uno R3"},
    {0x1a86, 0x7523, "CH340, as on many Nanos"},
    {0x1a86, 0x55d4, "CH9102"},
    {0x0403, 0x6001, "FTDI FT232R, as on early Nanos"},
    {0x0403, 0x6015, "FTDI FT231X"},
    {0x10c4, 0xea60, "CP210x"},
    {0x067b, 0x2303, "PL2303"},
};

std::string line_of(const fs::path& file) {
  std::string line;
  std::ifstream in(file);
  std::getline(in, line);
  return line;
}

std::optional<std::uint16_t> hex16(std::string_view text) {
  return parse_whole<std::uint16_t>(text, 16);
}

/// The folder of the USB device above a tty's; empty if it hangs on none.
fs::path usb_device_above(const fs::path& tty, const fs::path& root) {
  std::error_code error;
  fs::path folder = fs::canonical(tty / "device", error);
  if (error) return {};
  for (; folder.has_relative_path() && folder != root; folder = folder.parent_path())
    if (fs::exists(folder / "idVendor", error)) return folder;
  return {};
}

bool fits(const fs::path& device, const UsbIdentity& identity) {
  return hex16(line_of(device / "idVendor")) == identity.vendor &&
         hex16(line_of(device / "idProduct")) == identity.product &&
         (identity.serial.empty() || line_of(device / "serial") == identity.serial);
}

std::string described(std::uint16_t vendor, std::uint16_t product) {
  const std::string_view name = usb_board_name(vendor, product);
  return name.empty() ? fmt::format("{:04x}:{:04x}", vendor, product)
                      : fmt::format("{:04x}:{:04x} ({})", vendor, product, name);
}

struct Bus {
  bool seen = false;
  bool has_it = false;              ///< a device with vendor and product
  std::vector<std::string> boards;  ///< known ones that are plugged in
};

Bus look_at_bus(const UsbIdentity& wanted) {
  Bus out;
  libusb_context* raw = nullptr;
  if (libusb_init(&raw) != 0) return out;
  const std::unique_ptr<libusb_context, decltype(&libusb_exit)> context(raw, libusb_exit);
  libusb_device** list = nullptr;
  const ssize_t count = libusb_get_device_list(context.get(), &list);
  if (count < 0) return out;
  out.seen = true;
  for (ssize_t i = 0; i < count; ++i) {
    libusb_device_descriptor about{};
    if (libusb_get_device_descriptor(list[i], &about) != 0) continue;
    if (about.idVendor == wanted.vendor && about.idProduct == wanted.product) out.has_it = true;
    if (!usb_board_name(about.idVendor, about.idProduct).empty())
      out.boards.push_back(described(about.idVendor, about.idProduct));
  }
  libusb_free_device_list(list, 1);
  return out;
}

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
  for (const auto& [rate, speed] : kBauds)
    if (rate == baud) return speed;
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
    case ENOTDIR: return {Kind::absent, error};
    case EACCES:
    case EPERM: return {Kind::denied, error};
    case EBUSY:
    case EWOULDBLOCK: return {Kind::busy, error};
    case ENOTTY:
    case EISDIR: return {Kind::no_serial_port, error};
    default: return {Kind::other, error};
  }
}

}  // namespace

std::vector<std::string> stable_ports(const std::string& folder) {
  std::vector<std::string> out;
  std::error_code error;
  for (fs::directory_iterator it(folder, error), end; !error && it != end; it.increment(error))
    out.push_back(it->path().string());
  std::sort(out.begin(), out.end());
  return out;
}

std::string port_advice(const std::string& option, const std::string& folder) {
  const std::vector<std::string> ports = stable_ports(folder);
  if (ports.empty()) return "no USB serial port is plugged in here: plug the board in";
  return fmt::format("give {} one of: {}", option, fmt::join(ports, ", "));
}

std::string group_of(const std::string& path) {
  struct stat about {};
  if (::stat(path.c_str(), &about) != 0) return "?";
  const group* found = ::getgrgid(about.st_gid);
  return found != nullptr ? found->gr_name : std::to_string(about.st_gid);
}

std::string permission_advice(const std::string& path) {
  struct stat about {};
  const bool known = ::stat(path.c_str(), &about) == 0;
  const mode_t both = S_IRGRP | S_IWGRP;
  if (!known || (about.st_gid != 0 && (about.st_mode & both) == both)) {
    const std::string group = group_of(path);
    return fmt::format("it belongs to the group {}: `sudo usermod -aG {} $USER`, then log in again",
                       group, group);
  }
  const passwd* owner = ::getpwuid(about.st_uid);
  return fmt::format("only its owner {} may open it: `sudo chown $USER {}`",
                     owner != nullptr ? owner->pw_name : std::to_string(about.st_uid), path);
}

std::string holder_of(const std::string& path) {
  struct stat device {};
  if (::stat(path.c_str(), &device) != 0) return {};
  std::error_code error;
  for (fs::directory_iterator it("/proc", error), end; !error && it != end; it.increment(error)) {
    const std::string name = it->path().filename().string();
    if (!is_number(name) || name == std::to_string(::getpid()) || !has_open(it->path(), device))
      continue;
    std::string program = "a program";
    std::ifstream(it->path() / "comm") >> program;
    return fmt::format("{} (process {})", program, name);
  }
  return {};
}

std::string only_port(const std::string& option, const std::string& folder) {
  const std::vector<std::string> ports = stable_ports(folder);
  if (ports.size() == 1) return ports.front();
  if (ports.empty())
    throw ConfigError(
        "board: no USB serial port is plugged in here; plug the board in, or give {} PATH", option);
  throw ConfigError("board: {} serial ports are plugged in; pick one with {}: {}", ports.size(),
                    option, fmt::join(ports, ", "));
}

std::optional<UsbIdentity> parse_usb_identity(const std::string& text, const std::string& option) {
  if (text.rfind("usb:", 0) != 0) return {};
  const std::string_view rest = std::string_view(text).substr(4);
  const std::size_t first = rest.find(':');
  const std::size_t second = first == std::string_view::npos ? first : rest.find(':', first + 1);
  const auto vendor = hex16(rest.substr(0, first));
  const auto product =
      first == std::string_view::npos
          ? std::optional<std::uint16_t>{}
          : hex16(rest.substr(first + 1,
                              second == std::string_view::npos ? second : second - first - 1));
  if (!vendor || !product) {
    throw ConfigError(
        "{} '{}': not usb:VENDOR:PRODUCT[:SERIAL] in hex; for example usb:2341:0043, see `lsusb`",
        option, text);
  }
  UsbIdentity out{*vendor, *product, {}};
  if (second != std::string_view::npos) out.serial = rest.substr(second + 1);
  return out;
}

std::string_view usb_board_name(std::uint16_t vendor, std::uint16_t product) {
  for (const KnownBoard& board : kKnown)
    if (board.vendor == vendor && board.product == product) return board.name;
  return {};
}

std::vector<std::string> usb_serial_nodes(const UsbIdentity& identity, const std::string& sysfs) {
  std::vector<std::string> out;
  std::error_code error;
  const fs::path root = fs::canonical(sysfs, error);
  for (fs::directory_iterator it(root / "class/tty", error), end; !error && it != end;
       it.increment(error)) {
    const fs::path device = usb_device_above(it->path(), root);
    if (!device.empty() && fits(device, identity))
      out.push_back("/dev/" + it->path().filename().string());
  }
  std::sort(out.begin(), out.end());
  return out;
}

std::string find_usb_port(const UsbIdentity& identity, const std::string& option) {
  const std::vector<std::string> nodes = usb_serial_nodes(identity);
  if (nodes.size() == 1) return nodes.front();
  const std::string wanted =
      described(identity.vendor, identity.product) +
      (identity.serial.empty() ? std::string() : " with serial number " + identity.serial);
  if (nodes.size() > 1) {
    throw ConfigError(
        "{}: {} of them are plugged in ({}); add the serial number, usb:VENDOR:PRODUCT:SERIAL",
        wanted, nodes.size(), fmt::join(nodes, ", "));
  }
  const Bus bus = look_at_bus(identity);
  if (bus.has_it && identity.serial.empty()) {
    throw ConfigError(
        "{}: is plugged in, but has no serial port; load its driver (cdc_acm, ch341, ftdi_sio or "
        "cp210x)",
        wanted);
  }
  if (bus.boards.empty())
    throw ConfigError("{}: is not plugged in, nor is any other board that is known; plug it in",
                      wanted);
  throw ConfigError("{}: is not plugged in; plug it in, or give {} one that is there: {}", wanted,
                    option, fmt::join(bus.boards, ", "));
}

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
  // Keeps programs out that know no locks. A pseudo-terminal would stay exclusive when closed.
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
    case Kind::none: return path + ": open";
    case Kind::absent:
      return fmt::format("{}: there is no such port; {}", path, port_advice(option));
    case Kind::denied: return fmt::format("{}: no permission; {}", path, permission_advice(path));
    case Kind::busy: {
      const std::string holder = holder_of(path);
      return fmt::format("{}: in use by {}; end it, or give another port with {}", path,
                         holder.empty() ? "another program" : holder, option);
    }
    case Kind::no_serial_port:
      return fmt::format("{}: not a serial port; {}", path, port_advice(option));
    case Kind::no_such_baud:
      return fmt::format("{}: its driver does not do {} baud; use another adapter", path, baud);
    case Kind::other: break;
  }
  return fmt::format("{}: cannot be opened: {}; plug it in again", path,
                     std::strerror(failure.error));
}

}  // namespace tagwrench::link
