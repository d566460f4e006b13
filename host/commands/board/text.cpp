#include "host/commands/board/text.h"

#include <fmt/format.h>

namespace tagwrench {
namespace {

std::int64_t ns(TimePoint time) {
  return std::chrono::duration_cast<Duration>(time.time_since_epoch()).count();
}

std::string cell_text(std::size_t channel, const link::CellReading& reading,
                      const link::CellCalibration& calibration) {
  const char* full = reading.saturated ? " SATURATED" : "";
  if (!calibration.calibrated)
    return fmt::format("cell {} {:+9d} counts{}", channel, reading.counts, full);
  const link::Newtons force = calibration.newtons(reading.counts);
  return fmt::format("cell {} {:+9.4f} N ±{:.4f}{}", channel, force.value, force.sigma, full);
}

}  // namespace

std::string csv_line(const link::CellReading& reading, const link::CellCalibration& calibration) {
  std::string newtons = ",";
  if (calibration.calibrated) {
    const link::Newtons force = calibration.newtons(reading.counts);
    newtons = fmt::format("{:.6g},{:.3g}", force.value, force.sigma);
  }
  return fmt::format("{},{},{},{},{},{},{},{}\n", reading.saturated ? "cell_saturated" : "cell",
                     reading.channel, ns(reading.time.time), reading.time.sigma.count(),
                     reading.counts, newtons, reading.sequence, reading.lost_before);
}

std::string csv_line(const link::AdcReading& reading) {
  return fmt::format("adc,{},{},{},{},,,{},{}\n", reading.channel, ns(reading.time.time),
                     reading.time.sigma.count(), reading.counts, reading.sequence,
                     reading.lost_before);
}

std::string csv_line(const link::ButtonReading& reading) {
  return fmt::format("{},{},{},{},,,,,\n", reading.pressed ? "press" : "release", reading.button,
                     ns(reading.time.time), reading.time.sigma.count());
}

std::string csv_line(const link::FaultReading& reading) {
  return fmt::format("{},{},{},{},,,,,\n",
                     link::fault_name(static_cast<std::uint32_t>(reading.code)), reading.channel,
                     ns(reading.time.time), reading.time.sigma.count());
}

std::string json_line(const link::CellReading& reading, const link::CellCalibration& calibration) {
  std::string newtons = R"("f_n":null,"f_sigma_n":null)";
  if (calibration.calibrated) {
    const link::Newtons force = calibration.newtons(reading.counts);
    newtons = fmt::format(R"("f_n":{:.6g},"f_sigma_n":{:.3g})", force.value, force.sigma);
  }
  return fmt::format(
      R"({{"kind":"cell","channel":{},"t_ns":{},"t_sigma_ns":{},"counts":{},{},"saturated":{},)"
      R"("sequence":{},"lost_before":{}}})"
      "\n",
      reading.channel, ns(reading.time.time), reading.time.sigma.count(), reading.counts, newtons,
      reading.saturated, reading.sequence, reading.lost_before);
}

std::string json_line(const link::AdcReading& reading) {
  return fmt::format(
      R"({{"kind":"adc","channel":{},"t_ns":{},"t_sigma_ns":{},"counts":{},"sequence":{},)"
      R"("lost_before":{}}})"
      "\n",
      reading.channel, ns(reading.time.time), reading.time.sigma.count(), reading.counts,
      reading.sequence, reading.lost_before);
}

std::string json_line(const link::ButtonReading& reading) {
  return fmt::format(R"({{"kind":"button","button":{},"t_ns":{},"t_sigma_ns":{},"pressed":{}}})"
                     "\n",
                     reading.button, ns(reading.time.time), reading.time.sigma.count(),
                     reading.pressed);
}

std::string json_line(const link::FaultReading& reading) {
  return fmt::format(R"({{"kind":"fault","fault":"{}","channel":{},"t_ns":{},"t_sigma_ns":{}}})"
                     "\n",
                     link::fault_name(static_cast<std::uint32_t>(reading.code)), reading.channel,
                     ns(reading.time.time), reading.time.sigma.count());
}

void BoardView::take(const link::CellReading& reading) {
  if (reading.channel >= cells_.size()) return;
  Cell& cell = cells_[reading.channel];
  cell.seen = true;
  cell.reading = reading;
  cell.lost += reading.lost_before;
  latest_ = reading.time;
}

void BoardView::take(const link::AdcReading& reading) {
  if (reading.channel < adc_.size()) adc_[reading.channel] = reading.counts;
}

void BoardView::take(const link::ButtonReading& reading) {
  if (reading.button >= pressed_.size()) return;
  button_seen_[reading.button] = true;
  pressed_[reading.button] = reading.pressed;
}

std::string BoardView::line(const link::CellCalibrations& calibrations, const BoardLoop& loop,
                            TimePoint stale) const {
  const double t = std::chrono::duration<double>(latest_.time.time_since_epoch()).count();
  const double sigma_us = std::chrono::duration<double, std::micro>(latest_.sigma).count();
  std::string out = fmt::format("{:14.6f} s ±{:3.0f} us", t, sigma_us);
  for (std::size_t i = 0; i < cells_.size(); ++i) {
    const Cell& cell = cells_[i];
    const link::FaultCode fault = loop.cell_fault(i);
    out += "  ";
    if (fault == link::FaultCode::cell_stuck) {
      out += fmt::format("cell {} is stuck", i);
    } else if (!cell.seen || fault == link::FaultCode::cell_silent) {
      out += fmt::format("cell {} is not wired", i);
    } else if (cell.reading.time.time < stale) {
      out += fmt::format("cell {} is silent", i);
    } else {
      out += cell_text(i, cell.reading, calibrations[i]);
    }
    if (cell.lost > 0) out += fmt::format(" ({} lost)", cell.lost);
  }
  for (std::size_t i = 0; i < adc_.size(); ++i) {
    if (adc_[i] >= 0) out += fmt::format("  adc {} {}", i, adc_[i]);
  }
  for (std::size_t i = 0; i < pressed_.size(); ++i) {
    if (button_seen_[i]) out += fmt::format("  button {} {}", i, pressed_[i] ? "down" : "up");
  }
  return out + "\n";
}

}  // namespace tagwrench
