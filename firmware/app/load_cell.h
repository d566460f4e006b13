// Load cells: conversions become samples with a sequence, and a cell that says nothing becomes a
// fault, never a zero.
#pragma once

#include "firmware/app/faults.h"

namespace tagwrench {
namespace firmware {

class LoadCells {
 public:
  /// Starts every channel anew; `inputs` has kMaxCells of them. The first conversion of each is
  /// dropped: its age and input are not known.
  void configure(const link::CellInput* inputs, uint8_t rate_sps, uint32_t now_us);
  /// Averages the next conversions of the channels in the mask. Replaces a tare of theirs that is
  /// under way.
  link::Result tare(uint8_t mask, uint16_t conversions);

  /// Takes one conversion and sends its sample.
  void poll(Link& link, Faults& faults);
  /// Looks after one channel that may be silent.
  void watch(uint32_t now_us, Faults& faults);
  /// Sends the result of one finished tare. False: there is none.
  bool send_tare(Link& link);

  /// Measured over the last full second; 0 while nothing comes.
  uint16_t rate_centihertz(uint8_t channel) const { return cells_[channel].rate_centihertz; }

 private:
  enum class State : uint8_t {
    off,
    starting,  ///< the next conversion is to be dropped
    running,
    silent,
    stuck,
  };
  /// Conversions are summed in two parts, of 12 bits each, so that 32 bits do.
  struct Mean {
    uint32_t sum_high;
    uint32_t sum_low;
    int32_t least;
    int32_t most;
    uint16_t count;
    uint16_t wanted;  ///< 0: no tare
  };
  struct Cell {
    State state;
    uint16_t sequence;  ///< of the next conversion
    uint16_t missed;
    uint32_t heard_us;  ///< last conversion, or configuration
    uint32_t rate_since_us;
    uint16_t rate_count;
    uint16_t rate_centihertz;
    Mean tare;
  };

  void take(const board::Conversion& conversion, Link& link, Faults& faults);
  static void fail(Cell& cell, State state);
  static void measure_rate(Cell& cell, uint32_t time_us);
  static void add(Mean& tare, int32_t counts);

  Cell cells_[link::kMaxCells] = {};
  uint8_t watched_ = 0;  ///< channel whose silence is looked after next
};

}  // namespace firmware
}  // namespace tagwrench
