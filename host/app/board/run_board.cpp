#include "host/app/board/run_board.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "host/calibration/light/control.h"
#include "host/core/log.h"
#include "host/wrench/zero.h"

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

constexpr double kUnseenLevel_permille = 100;

class SteadyLamp final : public Lamp {
 public:
  explicit SteadyLamp(link::BoardLink& link) : link_(link) {}

  void set_level(double permille) noexcept override {
    link::Led led{};
    led.level_permille = static_cast<std::uint16_t>(std::lround(std::clamp(permille, 0.0, 1000.0)));
    led.mode = led.level_permille > 0 ? link::LedMode::steady : link::LedMode::off;
    link_.session().set_led(led);
    link_.send();
  }

  /// From two of its steps, so that a small change is one, up to what it may have for ever.
  LightRange range_permille() const noexcept override {
    const link::Capabilities& can = link_.session().capabilities();
    const double most = std::clamp<double>(can.led_sustained_permille, 1, 1000);
    const double steps = std::max<double>(can.led_levels, 2);
    return {std::min(most, 2000.0 / steps), most};
  }

  int poll_fd() const noexcept override { return link_.poll_fd(); }
  void service() noexcept override { link_.service(); }

 private:
  link::BoardLink& link_;
};

}  // namespace

BoardOutput::BoardOutput(link::BoardLink& link, const link::CellCalibrations& cells,
                         double cell_rate, double camera_latency, const std::string& path)
    : link_(link),
      cells_(cells),
      latency_(in_seconds(camera_latency)),
      counts_{link::SampleHistory({.period = 1 / cell_rate}),
              link::SampleHistory({.period = 1 / cell_rate}),
              link::SampleHistory({.period = 1 / cell_rate}),
              link::SampleHistory({.period = 1 / cell_rate})} {
  said_.reserve(256);
  if (!path.empty()) sink_.emplace(path, /*lossless=*/false);
}

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

std::string_view BoardOutput::service() noexcept {
  link_.service();
  take_readings();
  take_tares();
  write_ripe(/*all=*/false);
  said_.clear();
  said_.swap(found_);
  for (link::BoardEvent news; link_.next(news);) {
    if (record_) record_->news(news);
    if (!said_.empty()) said_ += "; ";
    said_ += link::text(news);
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
      found_ = fmt::format("load cell {} moved while it was tared; let it rest, then try again",
                           result.channel);
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
    SendStatus written = SendStatus::ok;
    if (!header_written_) {
      written = sink_->write(header());
      header_written_ = written == SendStatus::ok;
    }
    if (header_written_) written = sink_->write(text(row));
    status_ = std::max(status_, written);
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
  found_ = fault == ReferenceFault::scale
               ? fmt::format(
                     "against load cell {} the sensor measures {:.3f} +/- {:.3f} of the force: "
                     "look at the cell's line of action (wrench.reference), then `tagwrench check` "
                     "and `tagwrench calibrate wrench`",
                     line.channel, monitor_.scale(), monitor_.scale_sigma())
               : fmt::format(
                     "against load cell {} the zero is off by {:.4f} +/- {:.4f} N along its line: "
                     "hands off, `tagwrench board tare` and `tagwrench zero`",
                     line.channel, monitor_.zero(), monitor_.zero_sigma());
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

using record::EventKind;

void BoardRecord::cell(const link::CellReading& reading) noexcept {
  record::ReferenceRecord row;
  row.time = reading.time.time;
  row.time_sigma = reading.time.sigma;
  row.channel = reading.channel;
  row.axes = 1;
  row.counts[0] = reading.counts;
  row.saturated = reading.saturated;
  row.lost_before = reading.lost_before;
  if (reading.channel < cells_.size() && cells_[reading.channel].calibrated) {
    const link::Newtons force = cells_[reading.channel].newtons(reading.counts);
    row.value[0] = force.value;
    row.sigma[0] = force.sigma;
  }
  writer_.reference(row);
}

void BoardRecord::state(const link::BoardSession& session) noexcept {
  const TimePoint now = std::chrono::steady_clock::now();
  if (session.has_status() && session.status().led_level_permille != level_permille_) {
    level_permille_ = session.status().led_level_permille;
    writer_.event(EventKind::led, now, {}, level_permille_);
  }
  if (now < next_clock_ || !session.clock().known()) return;
  next_clock_ = now + std::chrono::seconds(1);
  const link::ClockReport clock = session.clock().report();
  const link::HostTime latest = session.clock().to_host(session.clock().to_board(now));
  std::array<char, 400> text{};
  const auto end = fmt::format_to_n(
      text.data(), text.size(),
      R"({{"sigma_us":{:.3g},"skew_ppm":{:.6g},"skew_sigma_ppm":{:.3g},"round_trip_us":{:.6g},)"
      R"("accepted":{},"rejected":{},"jumps":{},"temperature_centidegree":{}}})",
      static_cast<double>(latest.sigma.count()) * 1e-3, clock.skew_ppm, clock.skew_sigma_ppm,
      clock.round_trip_us, clock.accepted, clock.rejected, clock.jumps,
      session.has_status() ? session.status().temperature_centidegree : 0);
  writer_.event(EventKind::clock, now, {text.data(), std::min<std::size_t>(end.size, text.size())});
}

RunBoard::RunBoard(const BoardSetup& setup)
    : rate_(setup.cell_rate), loop_(setup.port, session_options(setup), "--board") {
  check_cells_file(setup);
  connected_ = loop_.settle();
  if (!connected_) return;
  cells_ = load_cells(setup, loop_.session());
}

RunBoard::~RunBoard() { SteadyLamp(loop_.link()).set_level(0); }

bool RunBoard::settle_light(Input& input, const UniqueFd& stop) {
  SteadyLamp lamp(loop_.link());
  if (input.kind != SourceKind::camera) {
    lamp.set_level(kUnseenLevel_permille);
    settled_permille_ = led_permille_ = kUnseenLevel_permille;
    log_info("the board's LED is on at {:.0f} %, but does not light this source",
             kUnseenLevel_permille / 10);
    return true;
  }
  Acquirer finder(input.sensor.camera, input.sensor.target);
  const LightReport report =
      tagwrench::settle_light(*input.source, finder, input.sensor.camera.mirrored, lamp, stop);
  settled_permille_ = led_permille_ = report.setting.led_permille;
  exposure_us_ = report.setting.exposure_us;
  if (!report.stopped) log_info(light_text(report));
  return !report.stopped;
}

std::unique_ptr<Output> RunBoard::output(const SensorConfig& sensor, const std::string& path) {
  const bool newtons = std::any_of(cells_.begin(), cells_.end(),
                                   [](const link::CellCalibration& c) { return c.calibrated; });
  if (!path.empty() && !newtons) {
    log_info(
        "the load cells are not calibrated: the reference has counts alone; `tagwrench board "
        "calibrate-cell` makes newtons of them");
  }
  auto output =
      std::make_unique<BoardOutput>(loop_.link(), cells_, rate_, sensor.camera_latency, path);
  output_ = output.get();
  if (sensor.reference) compare(*output, sensor);
  return output;
}

void RunBoard::compare(BoardOutput& output, const SensorConfig& sensor) const {
  const ReferenceLine& line = *sensor.reference;
  if (!cells_[static_cast<std::size_t>(line.channel)].calibrated) {
    log_info(
        "wrench.reference: load cell {} is not calibrated, so nothing is compared with it; run "
        "`tagwrench board calibrate-cell`",
        line.channel);
    return;
  }
  const WrenchEstimator wrench(sensor.wrench);
  output.compare({line, wrench.tool(), range_through(wrench.tool(), sensor.wrench.range)});
  log_info("every sample is compared with load cell {}", line.channel);
}

BoardReading RunBoard::reading() const noexcept {
  BoardReading reading;
  reading.led = led_permille_ / 1000;
  reading.exposure_us = exposure_us_;
  for (std::size_t i = 0; output_ != nullptr && i < reading.cells.size(); ++i)
    if (const std::optional<link::Newtons> felt = output_->felt(i))
      reading.cells[i] = {true, felt->value, felt->sigma};
  return reading;
}

void RunBoard::set_led(double level) noexcept {
  SteadyLamp lamp(loop_.link());
  led_permille_ = std::min(1000 * level, lamp.range_permille().most);
  lamp.set_level(led_permille_);
}

std::unique_ptr<RunBoard> open_board(const std::string& port, const std::string& cells_file) {
  if (port.empty()) return nullptr;
  return std::make_unique<RunBoard>(
      BoardSetup{.port = port == "auto" ? "" : port, .cells_file = cells_file});
}

}  // namespace tagwrench
