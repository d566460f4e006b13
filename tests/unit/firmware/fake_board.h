// A board for tests and the fuzzer: nothing happens by itself, time is what the test says, and
// everything that the application does to the board can be seen.
#pragma once

#include <cstdint>
#include <deque>
#include <vector>

#include "firmware/board/board.h"

namespace tagwrench::board {

struct FakeBoard {
  struct Edge {
    std::uint32_t at_us;
    bool on;
  };
  struct Button {
    bool pressed = false;
    bool changed = false;
    std::uint32_t first_us = 0;
  };

  std::uint32_t now_us = 1000;

  std::deque<SerialByte> incoming;
  std::vector<std::uint8_t> sent;
  std::uint8_t room = 255;  ///< what serial_room() says
  std::uint16_t overruns = 0;
  bool stamped = false;            ///< stamped bytes were sent,
  bool departed = true;            ///< and have begun to leave,
  std::uint32_t departure_us = 0;  ///< at this time

  bool pulses = false;
  std::uint16_t steady_permille = 0;
  std::vector<Edge> waiting;  ///< that are still ahead
  std::vector<Edge> light;    ///< changes that have happened, of pulses
  bool shining = false;
  std::int32_t heat = 0;    ///< that was kept; outlives a new App
  unsigned late_edges = 0;  ///< that were in the past when they were queued

  link::CellInput inputs[link::kMaxCells] = {};
  std::uint8_t cell_rate_sps = 0;
  std::deque<Conversion> conversions;

  std::uint8_t adc_mask = 0;
  std::uint8_t adc_rate_hz = 0;
  std::deque<Measurement> measurements;

  Button buttons[2];

  link::UniqueId id{};
  std::uint32_t boot_id = 7;
  link::ResetCause reset_cause = link::ResetCause::power_on;
  std::uint16_t supply_mv = 5000;
  bool host_lamp = false;

  /// Is the LED dark now, and does nothing wait to change that?
  bool dark() const { return pulses ? !shining && waiting.empty() : steady_permille == 0; }
  /// Moves the clock, and makes the edges that are due at their very time.
  void advance(std::uint32_t by_us);
  /// The line of a button changes at this time, now or past.
  void change(unsigned button, bool pressed, std::uint32_t at_us);
};

/// The one that board.h's functions act on. A test begins with a fresh one.
FakeBoard& fake_board();

}  // namespace tagwrench::board
