// A serial port of our own: raw bytes, never a wait.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

#include "host/board/serial_places.h"
#include "host/core/os/unique_fd.h"

namespace tagwrench::link {

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
  void set(const char* path) noexcept;
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
