// The light: steady, strobe or pattern, within what a bare LED without heat sink bears.
#pragma once

#include "firmware/app/faults.h"

namespace tagwrench {
namespace firmware {

/// A level that the LED may have for ever, and how long it may have 1000 permille from cold. In
/// between, heat counts: it rises with the light above the sustained level and falls below it. What
/// counts is the light that is there, not what was ordered, and it outlives a reset.
constexpr uint16_t kSustainedPermille = 300;
constexpr uint16_t kFullTimeMs = 10000;

class LedDriver {
 public:
  explicit LedDriver(uint32_t now_us);

  /// out_of_range, with nothing changed, if this board or LED cannot do it. Strobe and pattern
  /// begin at start_us + n * period_us, n >= 0; a start more than a minute ahead is a time past.
  link::Result command(const link::Led& command, uint32_t now_us);
  void off();
  /// To be called often: keeps account of the heat and the board's queue of edges filled.
  void poll(uint32_t now_us, Faults& faults);

  /// Mean, as driven.
  uint16_t level_permille() const {
    return limited_ && wanted_permille_ > kSustainedPermille ? kSustainedPermille
                                                             : wanted_permille_;
  }
  bool limited() const { return limited_; }
  uint32_t on_time_s() const { return on_time_s_; }

 private:
  void drive();
  void begin_pulses(uint32_t now_us);
  int32_t account(uint32_t now_us);
  uint16_t light_permille() const;
  void schedule(uint32_t now_us);
  void add_edges();
  void step();
  void catch_up();

  link::Led command_ = {};
  uint16_t wanted_permille_ = 0;  ///< mean of command_
  uint32_t next_us_ = 0;          ///< the next pulse or bit
  uint32_t pulse_us_ = 0;         ///< length of a pulse, or of the light in a bit that shines
  uint16_t state_ = 0;            ///< of the pattern at next_us_, less skip_ steps
  uint16_t skip_ = 0;             ///< steps of the pattern that are still to be made up
  bool shining_ = false;          ///< after the last queued edge
  bool limited_;
  uint32_t accounted_us_;  ///< heat and on-time are counted up to here
  uint16_t on_time_steps_ = 0;
  uint32_t on_time_s_ = 0;
};

}  // namespace firmware
}  // namespace tagwrench
