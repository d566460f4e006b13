#include "host/board/optoforce_sensor.h"

#include <fmt/format.h>

#include <cmath>

#include "host/core/config_error.h"

namespace tagwrench::link {
namespace {

TimePoint clock_now() { return std::chrono::steady_clock::now(); }

std::array<double, OptoforceFrame::kMaxAxes> scale_of(const std::vector<double>& counts_per_unit) {
  if (counts_per_unit.size() != 3 && counts_per_unit.size() != 6) {
    throw ConfigError(fmt::format(
        "--counts-per-unit: {} numbers, but a sensor has 3 (Fx,Fy,Fz) or 6 (and Tx,Ty,Tz); they "
        "stand in its data sheet",
        counts_per_unit.size()));
  }
  std::array<double, OptoforceFrame::kMaxAxes> out{};
  for (std::size_t i = 0; i < out.size(); ++i) {
    // Four 3-axis sensors are of one kind.
    const double counts = counts_per_unit.size() == 3 ? counts_per_unit[i % 3]
                          : i < 6                     ? counts_per_unit[i]
                                                      : 0;
    if (i < 6 && (!std::isfinite(counts) || counts == 0)) {
      throw ConfigError(
          "--counts-per-unit: a number is 0 or not finite; they stand in the sensor's data sheet");
    }
    out[i] = counts == 0 ? 0 : 1 / counts;
  }
  return out;
}

}  // namespace

OptoforceSensor::OptoforceSensor(const OptoforceOptions& options)
    : options_(options),
      command_(optoforce_command(options.rate_hz, options.filter_hz, options.zero)),
      scale_(scale_of(options.counts_per_unit)),
      serial_(options.port, options.baud),
      clock_(options.rate_hz > 0 ? 1.0 / options.rate_hz : 1) {
  begin(clock_now());
}

void OptoforceSensor::begin(TimePoint now) noexcept {
  mark_.set(options_.port.c_str());
  parser_.reset();
  clock_.restart();
  serial_.write(command_);
  serial_.flush_input();
  flushed_until_ = now + kFlushTime;
}

void OptoforceSensor::service() noexcept {
  const TimePoint now = clock_now();
  if (!serial_) {
    if (now < next_try_) return;
    next_try_ = now + kRetryPeriod;
    const char* path = options_.port.c_str();
    if (mark_.may_reopen(path) && !serial_.open(path, options_.baud)) begin(now);
    return;
  }
  std::array<std::uint8_t, 4096> room;
  const SerialPort::ReadResult got = serial_.read(room);
  if (got.gone) next_try_ = now + kRetryPeriod;
  if (now < flushed_until_) return;
  parser_.take({room.data(), got.count}, [&](const OptoforceFrame& frame) { take(frame, now); });
}

void OptoforceSensor::take(const OptoforceFrame& frame, TimePoint arrival) noexcept {
  OptoforceReading reading;
  reading.time = clock_.take(frame.counter, arrival);
  reading.axes = frame.axes;
  reading.status = frame.status;
  reading.counter = frame.counter;
  reading.lost_before = frame.lost_before;
  for (std::size_t i = 0; i < frame.axes; ++i) reading.values[i] = frame.counts[i] * scale_[i];
  readings_.push(reading);
}

}  // namespace tagwrench::link
