// The serial protocol of OptoForce force sensors: frames from bytes, and the configuration command.
// Pure; from the manufacturer's published frame layout, as three open drivers agree on it.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "host/board/clock_sync.h"
#include "host/board/ring.h"
#include "host/board/serial_port.h"

namespace tagwrench::link {

/// One sample, big-endian on the wire:
///   AA 07 08 n | counter u16 | status u16 | counts i16 ... | checksum u16 (sum of all before)
/// n = 0A: 16 bytes, 3 axes (Fx Fy Fz); 10: 22 bytes, 6 axes (Fx Fy Fz Tx Ty Tz); 1C: 34 bytes,
/// four 3-axis sensors.
struct OptoforceFrame {
  static constexpr std::size_t kMaxAxes = 12;

  std::uint16_t counter = 0;
  std::uint16_t status = 0;
  std::array<std::int16_t, kMaxAxes> counts{};
  std::uint8_t axes = 0;          ///< of `counts`
  std::uint16_t lost_before = 0;  ///< frames between the last one and this, by the counter
};

/// Fields of a status word.
struct OptoforceStatus {
  unsigned daq_error = 0;     ///< bits 15-13
  unsigned sensor_error = 0;  ///< bits 12-10
  unsigned overload = 0;      ///< bits 9-4: bit 5 is Fx, bit 0 is Tz
  bool several = false;       ///< bit 3: more than one sensor
  unsigned sensor = 0;        ///< bits 2-0: its number
};

constexpr OptoforceStatus split_status(std::uint16_t status) {
  return {status >> 13u & 7u, status >> 10u & 7u, status >> 4u & 0x3Fu, (status >> 3u & 1u) != 0,
          status & 7u};
}

/// "overload Fx Fz; sensor error 2"; empty if nothing is wrong.
std::string status_text(std::uint16_t status);

class OptoforceParser {
 public:
  struct Counters {
    std::uint64_t frames = 0;
    std::uint64_t interruptions = 0;  ///< places between two frames where bytes belonged to none
    std::uint64_t skipped_bytes = 0;
    std::uint64_t lost_frames = 0;  ///< by the counter
    std::uint64_t replies = 0;      ///< to configuration commands
  };

  /// Calls use(const OptoforceFrame&) for each frame that is whole. After bytes that belong to no
  /// frame it goes on with the next one whose header and checksum are right.
  template <class Use>
  void take(std::span<const std::uint8_t> bytes, Use&& use) {
    for (const std::uint8_t byte : bytes) {
      pending_[count_++] = byte;
      for (OptoforceFrame frame; next(frame);) use(static_cast<const OptoforceFrame&>(frame));
    }
  }

  /// The bytes before are not continued: the port was opened anew.
  void reset() noexcept {
    count_ = 0;
    have_frame_ = false;
    interrupted_ = false;
  }

  const Counters& counters() const noexcept { return counters_; }
  /// Of the last reply; 0 is success.
  std::uint8_t reply() const noexcept { return reply_; }

 private:
  static constexpr std::size_t kMaxBytes = 34;

  bool next(OptoforceFrame& frame) noexcept;
  std::size_t length() const noexcept;
  bool may_begin() const noexcept;
  bool checksum_fits(std::size_t length) const noexcept;
  void skip() noexcept {
    ++counters_.skipped_bytes;
    interrupted_ = true;
    consume(1);
  }
  void consume(std::size_t count) noexcept;
  void read(OptoforceFrame& frame, std::size_t length) noexcept;

  std::array<std::uint8_t, kMaxBytes> pending_{};
  std::size_t count_ = 0;
  bool have_frame_ = false;
  bool interrupted_ = false;
  std::uint16_t last_counter_ = 0;
  std::uint8_t reply_ = 0;
  Counters counters_;
};

/// Hz: 1000, 333, 100, 30 or 10 (0 stops the sensor); filter Hz: 500, 150, 50, 15, 5, 1.5 or 0 for
/// none. Throws ConfigError for other numbers.
std::array<std::uint8_t, 9> optoforce_command(int rate_hz, double filter_hz, bool zero);

// An OptoForce sensor on a serial port: forces with host times.

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
