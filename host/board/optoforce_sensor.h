// An OptoForce sensor on a serial port: forces with host times.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "host/board/clock_sync.h"
#include "host/board/optoforce.h"
#include "host/board/ring.h"
#include "host/board/serial_port.h"

namespace tagwrench::link {

struct OptoforceOptions {
  std::string port;
  unsigned baud = 1'000'000;
  int rate_hz = 100;
  double filter_hz = 15;
  bool zero = false;
  /// From the sensor's data sheet: counts per N of Fx Fy Fz, per N m of Tx Ty Tz. Three or six.
  std::vector<double> counts_per_unit;
};

struct OptoforceReading {
  HostTime time;
  std::array<double, OptoforceFrame::kMaxAxes> values{};  ///< N, N m
  std::uint8_t axes = 0;
  std::uint16_t status = 0;
  std::uint16_t counter = 0;
  std::uint16_t lost_before = 0;
};

class OptoforceSensor {
 public:
  static constexpr Duration kRetryPeriod = std::chrono::milliseconds(500);
  /// What came before the sensor was asked is older than it looks.
  static constexpr Duration kFlushTime = std::chrono::milliseconds(60);

  /// Opens the port, throws away what waits there, and configures the sensor. Throws ConfigError.
  explicit OptoforceSensor(const OptoforceOptions& options);

  /// -1 while unplugged; then service() is due every kRetryPeriod.
  int poll_fd() const noexcept { return serial_.fd(); }
  void service() noexcept;

  bool next(OptoforceReading& reading) noexcept { return readings_.pop(reading); }
  bool plugged() const noexcept { return static_cast<bool>(serial_); }
  const OptoforceParser::Counters& counters() const noexcept { return parser_.counters(); }
  std::uint64_t overwritten() const noexcept { return readings_.lost(); }
  double rate_hz() const noexcept { return 1 / clock_.period(); }

 private:
  void begin(TimePoint now) noexcept;
  void take(const OptoforceFrame& frame, TimePoint arrival) noexcept;

  OptoforceOptions options_;
  std::array<std::uint8_t, 9> command_;
  std::array<double, OptoforceFrame::kMaxAxes> scale_{};  ///< N or N m per count; 0: not told
  SerialPort serial_;
  TerminalMark mark_;
  OptoforceParser parser_;
  CounterClock clock_;
  TimePoint flushed_until_{};
  TimePoint next_try_{};
  Ring<OptoforceReading, 2048> readings_;
};

}  // namespace tagwrench::link
