#include "firmware/app/load_cell.h"

#include "firmware/app/elapsed.h"

namespace tagwrench {
namespace firmware {
namespace {

/// An HX711 settles for 0.4 s after it was configured, at its slow rate.
constexpr uint32_t kSilentUs = 1000000;
constexpr uint32_t kRateWindowUs = 1000000;

/// Both ends of 24 bits; an HX711 stays there when its input is beyond its range.
constexpr int32_t kMaxCounts = 0x7FFFFF;
constexpr int32_t kMinCounts = -0x800000;

constexpr uint16_t kMaxTareConversions = 1000;
constexpr uint8_t kLowBits = 12;

}  // namespace

void LoadCells::configure(const link::CellInput* inputs, uint8_t rate_sps, uint32_t now_us) {
  board::cell_rate(rate_sps);
  for (uint8_t i = 0; i < board::kTraits.cells; ++i) {
    Cell& cell = cells_[i];
    fail(cell, inputs[i] == link::CellInput::off ? State::off : State::starting);
    cell.heard_us = now_us;
    board::cell_input(i, inputs[i]);
  }
}

link::Result LoadCells::tare(uint8_t mask, uint16_t conversions) {
  if (mask == 0 || (mask >> board::kTraits.cells) != 0 || conversions == 0 ||
      conversions > kMaxTareConversions)
    return link::Result::out_of_range;
  for (uint8_t i = 0; i < board::kTraits.cells; ++i) {
    const State state = cells_[i].state;
    if ((mask >> i & 1) && state != State::running && state != State::starting)
      return link::Result::not_ready;
  }
  for (uint8_t i = 0; i < board::kTraits.cells; ++i) {
    if (mask >> i & 1) cells_[i].tare = Mean{0, 0, kMaxCounts, kMinCounts, 0, conversions};
  }
  return link::Result::ok;
}

void LoadCells::poll(Link& link, Faults& faults) {
  board::Conversion conversion;
  if (board::cell_take(conversion)) take(conversion, link, faults);
}

void LoadCells::watch(uint32_t now_us, Faults& faults) {
  if (++watched_ >= board::kTraits.cells) watched_ = 0;
  Cell& cell = cells_[watched_];
  const bool expected = cell.state == State::starting || cell.state == State::running;
  if (!expected || !reached(now_us, cell.heard_us + kSilentUs)) return;
  fail(cell, State::silent);
  faults.raise(link::FaultCode::cell_silent, watched_, now_us);
}

void LoadCells::take(const board::Conversion& conversion, Link& link, Faults& faults) {
  Cell& cell = cells_[conversion.channel];
  if (cell.state == State::off) return;
  cell.heard_us = conversion.time_us;
  if (conversion.stuck) {
    if (cell.state != State::stuck)
      faults.raise(link::FaultCode::cell_stuck, conversion.channel, conversion.time_us);
    fail(cell, State::stuck);
    return;
  }
  if (cell.state != State::running) {
    cell.state = State::running;
    return;
  }
  link.count_dropped(conversion.lost);
  cell.sequence = static_cast<uint16_t>(cell.sequence + conversion.lost);
  cell.missed = static_cast<uint16_t>(cell.missed + conversion.lost);
  cell.rate_count = static_cast<uint16_t>(cell.rate_count + conversion.lost);
  measure_rate(cell, conversion.time_us);
  add(cell.tare, conversion.counts);
  const bool saturated = conversion.counts >= kMaxCounts || conversion.counts <= kMinCounts;
  link.send(link::CellSample{conversion.channel, conversion.counts, conversion.time_us,
                             cell.sequence, cell.missed, saturated});
  ++cell.sequence;
}

bool LoadCells::send_tare(Link& link) {
  for (uint8_t i = 0; i < board::kTraits.cells; ++i) {
    Mean& tare = cells_[i].tare;
    if (tare.wanted == 0 || tare.count < tare.wanted) continue;
    const uint32_t high = tare.sum_high / tare.count;
    const uint32_t rest = tare.sum_high % tare.count;
    const uint32_t low = ((rest << kLowBits) + tare.sum_low + tare.count / 2) / tare.count;
    const link::TareResult result = {i, static_cast<int32_t>((high << kLowBits) + low) + kMinCounts,
                                     static_cast<uint32_t>(tare.most - tare.least), tare.count};
    if (link.send(result)) tare.wanted = 0;
    return true;
  }
  return false;
}

void LoadCells::fail(Cell& cell, State state) {
  cell.state = state;
  cell.rate_count = 0;
  cell.rate_centihertz = 0;
  cell.tare.wanted = 0;
}

void LoadCells::measure_rate(Cell& cell, uint32_t time_us) {
  const uint32_t window_us = time_us - cell.rate_since_us;
  if (cell.rate_count != 0 && window_us < kRateWindowUs) {
    ++cell.rate_count;
    return;
  }
  // In tens of microseconds, so that it fits 32 bits.
  if (cell.rate_count != 0)
    cell.rate_centihertz = static_cast<uint16_t>(cell.rate_count * 10000000ul / (window_us / 10));
  cell.rate_since_us = time_us;
  cell.rate_count = 1;
}

void LoadCells::add(Mean& tare, int32_t counts) {
  if (tare.count >= tare.wanted) return;
  const uint32_t above = static_cast<uint32_t>(counts - kMinCounts);
  tare.sum_high += above >> kLowBits;
  tare.sum_low += above & ((1u << kLowBits) - 1);
  if (counts < tare.least) tare.least = counts;
  if (counts > tare.most) tare.most = counts;
  ++tare.count;
}

}  // namespace firmware
}  // namespace tagwrench
