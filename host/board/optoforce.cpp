#include "host/board/optoforce.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstring>

#include "host/core/config_error.h"

namespace tagwrench::link {
namespace {

constexpr std::array<std::uint8_t, 3> kSampleHeader{0xAA, 0x07, 0x08};
constexpr std::array<std::uint8_t, 4> kReplyHeader{0xAA, 0x00, 0x50, 0x01};
constexpr std::size_t kReplyBytes = 7;
constexpr std::size_t kHeaderBytes = 4;
constexpr std::size_t kBeforeCounts = 8;
constexpr std::size_t kChecksumBytes = 2;

constexpr const char* kAxes[] = {"Fx", "Fy", "Fz", "Tx", "Ty", "Tz"};

/// Of the byte after the header: what follows, but for the checksum, in bytes.
bool is_size(std::uint8_t size) { return size == 0x0A || size == 0x10 || size == 0x1C; }

std::uint16_t big_endian(const std::uint8_t* bytes) {
  return static_cast<std::uint16_t>(bytes[0] << 8 | bytes[1]);
}

TimePoint clock_now() { return std::chrono::steady_clock::now(); }

std::array<double, OptoforceFrame::kMaxAxes> scale_of(const std::vector<double>& counts_per_unit) {
  if (counts_per_unit.size() != 3 && counts_per_unit.size() != 6) {
    throw ConfigError(
        "--counts-per-unit: {} numbers, but a sensor has 3 (Fx,Fy,Fz) or 6 (and Tx,Ty,Tz); they "
        "stand in its data sheet",
        counts_per_unit.size());
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

std::string status_text(std::uint16_t status) {
  const OptoforceStatus fields = split_status(status);
  std::string out;
  const auto add = [&out](const std::string& text) { out += (out.empty() ? "" : "; ") + text; };
  if (fields.daq_error != 0) add(fmt::format("DAQ error {}", fields.daq_error));
  if (fields.sensor_error != 0) add(fmt::format("sensor error {}", fields.sensor_error));
  if (fields.overload != 0) {
    std::string axes = "overload";
    for (unsigned i = 0; i < 6; ++i)
      if ((fields.overload >> (5 - i) & 1) != 0) axes += fmt::format(" {}", kAxes[i]);
    add(axes);
  }
  return out;
}

bool OptoforceParser::next(OptoforceFrame& frame) noexcept {
  while (count_ > 0) {
    if (!may_begin()) {
      skip();
      continue;
    }
    const std::size_t whole = length();
    if (whole == 0 || count_ < whole) return false;
    if (!checksum_fits(whole)) {
      skip();
      continue;
    }
    if (whole == kReplyBytes) {
      ++counters_.replies;
      reply_ = pending_[4];
      consume(whole);
      continue;
    }
    read(frame, whole);
    consume(whole);
    return true;
  }
  return false;
}

/// Whether what is pending could be the beginning of a frame or a reply.
bool OptoforceParser::may_begin() const noexcept {
  const auto begins = [this](const auto& header) {
    return std::equal(
        pending_.begin(),
        pending_.begin() + static_cast<std::ptrdiff_t>(std::min(count_, header.size())),
        header.begin());
  };
  if (begins(kReplyHeader)) return true;
  return begins(kSampleHeader) && (count_ < kHeaderBytes || is_size(pending_[3]));
}

/// Of the whole frame or reply; 0 as long as the header does not say.
std::size_t OptoforceParser::length() const noexcept {
  if (count_ < kHeaderBytes) return 0;
  if (pending_[1] == kReplyHeader[1]) return kReplyBytes;
  return kHeaderBytes + pending_[3] + kChecksumBytes;
}

bool OptoforceParser::checksum_fits(std::size_t length) const noexcept {
  unsigned sum = 0;
  for (std::size_t i = 0; i < length - kChecksumBytes; ++i) sum += pending_[i];
  return big_endian(&pending_[length - kChecksumBytes]) == (sum & 0xFFFF);
}

void OptoforceParser::consume(std::size_t count) noexcept {
  std::memmove(pending_.data(), pending_.data() + count, count_ - count);
  count_ -= count;
}

void OptoforceParser::read(OptoforceFrame& frame, std::size_t length) noexcept {
  frame = {};
  frame.counter = big_endian(&pending_[4]);
  frame.status = big_endian(&pending_[6]);
  frame.axes = static_cast<std::uint8_t>((length - kBeforeCounts - kChecksumBytes) / 2);
  for (std::size_t i = 0; i < frame.axes; ++i)
    frame.counts[i] = static_cast<std::int16_t>(big_endian(&pending_[kBeforeCounts + 2 * i]));
  if (have_frame_) {
    frame.lost_before = static_cast<std::uint16_t>(frame.counter - last_counter_ - 1);
    counters_.lost_frames += frame.lost_before;
    if (interrupted_) ++counters_.interruptions;
  }
  have_frame_ = true;
  interrupted_ = false;
  last_counter_ = frame.counter;
  ++counters_.frames;
}

std::array<std::uint8_t, 9> optoforce_command(int rate_hz, double filter_hz, bool zero) {
  struct Rate {
    int hz;
    std::uint8_t code;
  };
  constexpr Rate kRates[] = {{0, 0}, {1000, 1}, {333, 3}, {100, 10}, {30, 33}, {10, 100}};
  constexpr double kFilters[] = {0, 500, 150, 50, 15, 5, 1.5};
  const auto* rate =
      std::find_if(std::begin(kRates), std::end(kRates), [&](Rate r) { return r.hz == rate_hz; });
  if (rate == std::end(kRates))
    throw ConfigError("OptoForce: it has no rate of {} Hz; use 1000, 333, 100, 30 or 10", rate_hz);
  const auto* filter = std::find(std::begin(kFilters), std::end(kFilters), filter_hz);
  if (filter == std::end(kFilters)) {
    throw ConfigError(
        "OptoForce: it has no filter of {} Hz; use 500, 150, 50, 15, 5, 1.5 or 0 for none",
        filter_hz);
  }
  std::array<std::uint8_t, 9> out{0xAA,
                                  0x00,
                                  0x32,
                                  0x03,
                                  rate->code,
                                  static_cast<std::uint8_t>(filter - std::begin(kFilters)),
                                  static_cast<std::uint8_t>(zero ? 255 : 0)};
  unsigned sum = 0;
  for (std::size_t i = 0; i < 7; ++i) sum += out[i];
  out[7] = static_cast<std::uint8_t>(sum >> 8);
  out[8] = static_cast<std::uint8_t>(sum);
  return out;
}

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
