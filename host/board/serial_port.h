// Where serial ports are, whose they are and who has them: for choosing one and for messages.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "host/core/os/unique_fd.h"

namespace tagwrench::link {

constexpr const char* kPortOption = "--port";  ///< of the command line
constexpr const char* kStablePorts = "/dev/serial/by-id";

/// Stable paths of all serial ports with a USB identity, sorted; of the folder that udev keeps.
std::vector<std::string> stable_ports(const std::string& folder = kStablePorts);

/// "give --port one of: ...", or that nothing is plugged in; `option` names the port.
std::string port_advice(const std::string& option = kPortOption,
                        const std::string& folder = kStablePorts);

/// Why a file that exists may not be opened, and the remedy: its group, if that may, or its owner.
std::string permission_advice(const std::string& path);

/// Name of the file's group; its number if it has no name; "?" if there is no such file.
std::string group_of(const std::string& path);

/// "tagwrench (process 4711)": the first other process that has this device open, as far as this
/// user may look; empty if none is seen.
std::string holder_of(const std::string& path);

/// The only stable port. Throws ConfigError if there is none or more than one.
std::string only_port(const std::string& option = kPortOption,
                      const std::string& folder = kStablePorts);

// A board by its USB identity instead of a path.

struct UsbIdentity {
  std::uint16_t vendor = 0;
  std::uint16_t product = 0;
  std::string serial;  ///< empty: any
};

/// Of "usb:VID:PID[:SERIAL]", numbers in hex; nothing if `text` does not begin with "usb:". Throws
/// ConfigError, naming the `option`, if the rest cannot be read.
std::optional<UsbIdentity> parse_usb_identity(const std::string& text,
                                              const std::string& option = kPortOption);

/// "Arduino Uno", "CH340 (Nano clones)", ...; empty if not known.
std::string_view usb_board_name(std::uint16_t vendor, std::uint16_t product);

/// Device nodes ("/dev/ttyUSB0") of serial ports with this identity, sorted; from sysfs alone, for
/// a loop that waits for a board to come back.
std::vector<std::string> usb_serial_nodes(const UsbIdentity& identity,
                                          const std::string& sysfs = "/sys");

/// The only such node. Throws ConfigError with what is plugged in, drivers or not (as libusb sees
/// the bus), if there is none or more than one.
std::string find_usb_port(const UsbIdentity& identity, const std::string& option = kPortOption);

// A serial port of our own: raw bytes, never a wait.

struct SerialFailure {
  enum class Kind : std::uint8_t {
    none,
    absent,
    denied,
    busy,
    no_serial_port,
    no_such_baud,
    other
  };
  Kind kind = Kind::none;
  int error = 0;  ///< errno, where there is one

  explicit operator bool() const { return kind != Kind::none; }
};

class SerialPort {
 public:
  struct ReadResult {
    std::size_t count = 0;
    bool gone = false;  ///< unplugged, or hung up; the port is closed
  };

  SerialPort() = default;

  /// Raw, 8N1, this program's alone; what had come before is thrown away. Throws ConfigError with
  /// one line that names the remedy, and `option` where another port is one. An Arduino resets when
  /// its port is opened.
  SerialPort(const std::string& path, unsigned baud, const std::string& option = kPortOption);

  /// The same without message, for a loop that tries again.
  SerialFailure open(const char* path, unsigned baud) noexcept;
  void close() noexcept { fd_.reset(); }

  explicit operator bool() const noexcept { return static_cast<bool>(fd_); }
  int fd() const noexcept { return fd_.get(); }

  /// What is there, up to the room given.
  ReadResult read(std::span<std::uint8_t> room) noexcept;

  /// False: gone. Bytes that the driver has no room for are dropped and counted.
  bool write(std::span<const std::uint8_t> bytes) noexcept;

  /// Throws away what has come and was not read.
  void flush_input() noexcept;

  std::uint64_t dropped_bytes() const noexcept { return dropped_; }

 private:
  UniqueFd fd_;
  std::uint64_t dropped_ = 0;
};

/// The number of a pseudo-terminal that was closed is given to whoever opens one next, a shell say.
/// This remembers which one a path stood for, so that only another one is opened again.
class TerminalMark {
 public:
  /// Of a path that was just opened.
  void set(const char* path) noexcept { look(path, *this); }
  /// False for a pseudo-terminal, if the path is not a link that was made anew.
  bool may_reopen(const char* path) const noexcept;

 private:
  static bool look(const char* path, TerminalMark& mark) noexcept;

  std::uint64_t link_inode_ = 0;  ///< 0: no link
  std::int64_t link_time_ns_ = 0;
};

/// One line: what, where, remedy.
std::string text(const SerialFailure& failure, const std::string& path, unsigned baud,
                 const std::string& option = kPortOption);

}  // namespace tagwrench::link
