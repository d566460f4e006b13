// What the LED's gate did: a piecewise constant mean level over time. Pulse-width modulation counts
// as its mean level, pulses of timer 1 and plain pin levels as edges.
#pragma once

#include <vector>

#include "tests/firmware/avr_core.h"

namespace tagwrench::emulator {

struct LedChange {
  VirtualTime time{};
  double level = 0;  ///< 0..1
};

struct LedPulse {
  VirtualTime begin{};
  VirtualTime end{};
};

class LedLog {
 public:
  LedLog() : changes_{{VirtualTime(0), 0.0}} {}

  void set(VirtualTime time, double level);
  double level() const { return changes_.back().level; }
  double level_at(VirtualTime time) const;
  /// Mean level over an interval that ends at or before `now`.
  double mean(VirtualTime from, VirtualTime to) const;
  /// Changes within [from, to).
  std::vector<LedChange> changes(VirtualTime from, VirtualTime to) const;
  /// Intervals of light that begin and end within [from, to).
  std::vector<LedPulse> pulses(VirtualTime from, VirtualTime to) const;
  const std::vector<LedChange>& all() const { return changes_; }
  /// Keeps the last state only.
  void forget() { changes_.erase(changes_.begin(), changes_.end() - 1); }

 private:
  std::vector<LedChange>::const_iterator last_until(VirtualTime time) const;

  std::vector<LedChange> changes_;
};

}  // namespace tagwrench::emulator
