#include "host/app/board/board_output.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <exception>

namespace tagwrench {
namespace {

constexpr Duration kPatience = std::chrono::milliseconds(500);
constexpr std::uint16_t kTareConversions = 80;
/// Of a resting cell's noise, from end to end of its conversions.
constexpr double kMaxTareSpread = 15;
constexpr double kMinTareNoise_counts = 0.5;

std::string header() {
  std::string line(kCsvHeader.substr(0, kCsvHeader.size() - 1));
  for (std::size_t i = 0; i < link::kMaxChannels; ++i)
    line += fmt::format(",cell{0}_counts,cell{0}_n,cell{0}_sigma_n", i);
  return line + "\n";
}

/// Newtons of interpolated counts: their own noise in place of a single conversion's.
link::Newtons newtons(const link::CellCalibration& cell, const link::Aligned& counts) {
  link::Newtons force = cell.newtons(counts.value);
  const double conversion = cell.noise_counts * cell.newtons_per_count;
  const double line = std::max(0.0, force.sigma * force.sigma - conversion * conversion);
  force.sigma = std::hypot(std::sqrt(line), counts.sigma * cell.newtons_per_count);
  return force;
}

}  // namespace

BoardOutput::BoardOutput(link::BoardLink& link, const link::CellCalibrations& cells,
                         double cell_rate, double camera_latency, const std::string& path)
    : link_(link),
      cells_(cells),
      latency_(std::chrono::duration_cast<Duration>(std::chrono::duration<double>(camera_latency))),
      counts_{link::SampleHistory({.period = 1 / cell_rate}),
              link::SampleHistory({.period = 1 / cell_rate}),
              link::SampleHistory({.period = 1 / cell_rate}),
              link::SampleHistory({.period = 1 / cell_rate})} {
  said_.reserve(256);
  if (!path.empty()) sink_.emplace(path, /*lossless=*/false);
}

BoardOutput::~BoardOutput() { write_ripe(/*all=*/true); }

SendStatus BoardOutput::send(const Sample& sample) noexcept {
  if (!sink_ && !comparison_) return SendStatus::ok;
  const TimePoint now = std::chrono::steady_clock::now();
  const bool room = rows_.size() < kMaxRows;
  if (room) rows_.push({sample, now});
  write_ripe(/*all=*/false);
  const SendStatus status = std::exchange(status_, SendStatus::ok);
  if (status == SendStatus::failed) status_ = status;  // for good
  return room || status == SendStatus::failed ? status : SendStatus::skipped;
}

std::string BoardOutput::failure() const { return sink_ ? sink_->failure() : std::string(); }

std::string_view BoardOutput::service() noexcept {
  link_.service();
  take_readings();
  take_tares();
  write_ripe(/*all=*/false);
  said_.clear();
  try {
    said_.swap(found_);
    for (link::BoardEvent news; link_.next(news);) {
      if (record_) record_->news(news);
      if (!said_.empty()) said_ += "; ";
      said_ += link::text(news);
    }
  } catch (const std::exception&) {
    said_.clear();  // out of memory: unsaid
  }
  return said_;
}

void BoardOutput::take_readings() noexcept {
  link::BoardSession& session = link_.session();
  if (record_) record_->state(session);
  for (link::CellReading r; session.next(r);) {
    if (record_) record_->cell(r);
    if (r.channel < counts_.size() && !r.saturated) {
      last_counts_[r.channel] = r.counts;
      counts_[r.channel].add(r.time.time, r.time.sigma, r.counts, 0, r.lost_before > 0);
    }
  }
  for (link::ButtonReading r; session.next(r);) {
    if (record_) record_->button(r);
    if (r.button >= 32) continue;
    const std::uint32_t bit = std::uint32_t{1} << r.button;
    buttons_down_ = r.pressed ? buttons_down_ | bit : buttons_down_ & ~bit;
  }
}

/// One that moved meanwhile keeps its zero.
void BoardOutput::take_tares() noexcept {
  for (link::TareResult result{}; link_.session().next(result);) {
    if (result.channel >= cells_.size()) continue;
    link::CellCalibration& cell = cells_[result.channel];
    if (!cell.calibrated) continue;
    const double noise = std::max(cell.noise_counts, kMinTareNoise_counts);
    if (result.spread_counts > kMaxTareSpread * noise) {
      try {
        found_ = fmt::format("load cell {} moved while it was tared; let it rest, then try again",
                             result.channel);
      } catch (const std::exception&) {
        found_.clear();  // out of memory: unsaid
      }
      continue;
    }
    cell.zero_counts = result.mean_counts;
  }
}

std::optional<link::Newtons> BoardOutput::felt(std::size_t channel) const noexcept {
  if (channel >= cells_.size() || !cells_[channel].calibrated || !last_counts_[channel]) return {};
  return cells_[channel].newtons(*last_counts_[channel]);
}

bool BoardOutput::tare(std::size_t channel) noexcept {
  if (!felt(channel)) return false;
  link_.session().tare(static_cast<std::uint8_t>(1U << channel), kTareConversions);
  link_.send();
  return true;
}

/// Whether nothing more will be known about the row's time.
bool BoardOutput::ripe(const Row& row, TimePoint now) const noexcept {
  if (now - row.sent >= kPatience) return true;
  return std::none_of(counts_.begin(), counts_.end(), [&](const link::SampleHistory& counts) {
    return counts.at(row.sample.capture_time - latency_).status == link::AlignStatus::too_new;
  });
}

void BoardOutput::write_ripe(bool all) noexcept {
  const TimePoint now = std::chrono::steady_clock::now();
  while (!rows_.empty() && (all || ripe(rows_[0], now))) {
    Row row;
    rows_.pop(row);
    compare(row);
    if (!sink_) continue;
    try {
      SendStatus written = SendStatus::ok;
      if (!header_written_) {
        written = sink_->write(header());
        header_written_ = written == SendStatus::ok;
      }
      if (header_written_) written = sink_->write(text(row));
      status_ = std::max(status_, written);
    } catch (const std::exception&) {
      status_ = std::max(status_, SendStatus::skipped);  // out of memory
    }
  }
}

void BoardOutput::compare(const Row& row) noexcept {
  if (!comparison_ || row.sample.status != Status::ok) return;
  const ReferenceLine& line = comparison_->line;
  const auto channel = static_cast<std::size_t>(line.channel);
  const link::Aligned counts = counts_[channel].at(row.sample.capture_time - latency_);
  if (counts.status != link::AlignStatus::ok || !cells_[channel].calibrated) return;
  // Where the point has gone with the platform; a turn of some hundredths is small.
  const Vector6& d = row.sample.displacement;
  const Eigen::Vector3d turn = d.tail<3>();
  const Eigen::Vector3d point = line.point + d.head<3>() + turn.cross(line.point);
  Vector6 unit;
  unit << line.direction, point.cross(line.direction);
  const ReferenceFault fault =
      monitor_.add(row.sample.capture_time, row.sample.wrench, comparison_->tool * unit,
                   comparison_->range, newtons(cells_[channel], counts).value);
  if (fault == ReferenceFault::none) return;
  try {
    found_ = fault == ReferenceFault::scale
                 ? fmt::format(
                       "against load cell {} the sensor measures {:.3f} +/- {:.3f} of the "
                       "force: look at the cell's line of action (wrench.reference), then "
                       "`tagwrench check` and `tagwrench calibrate wrench`",
                       line.channel, monitor_.scale(), monitor_.scale_sigma())
                 : fmt::format(
                       "against load cell {} the zero is off by {:.4f} +/- {:.4f} N along "
                       "its line: hands off, `tagwrench board tare` and `tagwrench zero`",
                       line.channel, monitor_.zero(), monitor_.zero_sigma());
  } catch (const std::exception&) {
    found_.clear();  // out of memory: unsaid
  }
}

std::string_view BoardOutput::text(const Row& row) noexcept {
  const std::string_view sample = csv_line(sample_line_, row.sample);
  char* out = std::copy(sample.begin(), sample.end() - 1, line_.data());
  const char* end = line_.data() + line_.size() - 1;
  for (std::size_t i = 0; i < counts_.size(); ++i) {
    const link::Aligned counts = counts_[i].at(row.sample.capture_time - latency_);
    const auto room = static_cast<std::size_t>(end - out);
    if (counts.status != link::AlignStatus::ok) {
      out = fmt::format_to_n(out, room, ",,,").out;
    } else if (!cells_[i].calibrated) {
      out = fmt::format_to_n(out, room, ",{:.1f},,", counts.value).out;
    } else {
      const link::Newtons force = newtons(cells_[i], counts);
      out = fmt::format_to_n(out, room, ",{:.1f},{:.6g},{:.3g}", counts.value, force.value,
                             force.sigma)
                .out;
    }
  }
  *out++ = '\n';
  return {line_.data(), static_cast<std::size_t>(out - line_.data())};
}

}  // namespace tagwrench
