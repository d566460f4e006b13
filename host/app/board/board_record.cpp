#include "host/app/board/board_record.h"

#include <fmt/format.h>

#include <array>

namespace tagwrench {

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

void BoardRecord::button(const link::ButtonReading& reading) noexcept {
  writer_.event(EventKind::button, reading.time.time, {}, reading.pressed ? 1 : 0, reading.button);
}

void BoardRecord::news(const link::BoardEvent& news) {
  writer_.event(EventKind::board, std::chrono::steady_clock::now(), link::text(news));
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

}  // namespace tagwrench
