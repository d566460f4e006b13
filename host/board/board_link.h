// A board on a serial port: the session's bytes come and go, and a port that was unplugged is
// opened again. One descriptor to wait for, never a wait inside.
#pragma once

#include <optional>
#include <string>

#include "host/board/board_session.h"
#include "host/board/serial_port.h"
#include "host/core/os/unique_fd.h"

namespace tagwrench::link {

/// Options with a session number and an id for a new board, both drawn at random.
BoardSessionOptions new_session();

class BoardLink {
 public:
  static constexpr Duration kRetryPeriod = std::chrono::milliseconds(500);

  /// `port` is a path (best one of /dev/serial/by-id, which stays the same), usb:VID:PID[:SERIAL],
  /// or empty for the only USB serial port. Throws ConfigError, naming the `option` that chooses
  /// the port, if it cannot be opened.
  BoardLink(const std::string& port, const BoardSessionOptions& options, unsigned baud = kBaud,
            const std::string& option = kPortOption);

  /// Readable when service() has something to do.
  int poll_fd() const noexcept { return epoll_.get(); }

  /// Reads, answers, and opens the port again if it was lost. Returns soon, whatever happens.
  void service() noexcept;

  /// Sends what the session has to say at once, for orders just given.
  void send() noexcept;

  BoardSession& session() noexcept { return session_; }
  const BoardSession& session() const noexcept { return session_; }
  bool plugged() const noexcept { return static_cast<bool>(serial_); }
  const std::string& port() const noexcept { return path_; }

  /// BoardEvent of the session and of the port, oldest first.
  bool next(BoardEvent& news) noexcept { return session_.next(news) || news_.pop(news); }

  /// One line: what came from the port instead of a board's greeting, and what may be the matter.
  std::string why_no_board() const;

 private:
  void watch_serial() noexcept;
  void receive() noexcept;
  void lost() noexcept;
  void try_again(TimePoint now) noexcept;
  void arm(TimePoint when) noexcept;

  std::string path_;
  std::optional<UsbIdentity> identity_;
  unsigned baud_;
  SerialPort serial_;
  TerminalMark mark_;
  BoardSession session_;
  UniqueFd epoll_;
  UniqueFd timer_;
  TimePoint next_try_{};
  TimePoint armed_ = TimePoint::max();  ///< of the timer
  Ring<BoardEvent, 8> news_;
};

}  // namespace tagwrench::link
