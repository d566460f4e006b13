// When input devices move: with every sample, or, where a profile asks for a steady rate, at that
// rate between frames too. Times are passed in.
#pragma once

#include "host/core/types.h"

namespace tagwrench {

class OutputScheduler {
 public:
  enum class Move : std::uint8_t {
    none,         ///< the clock's turn comes later
    with_sample,  ///< to what the sample says
    on            ///< to where the motion is by now
  };

  /// A sample was made. `period` of the moves; zero: they have none. Without numbers devices move
  /// at once, to neutral, and rest.
  Move sample(bool numbers, Duration period, TimePoint now) noexcept;

  /// Whether devices are to move on. The next time is one period later, and not earlier than now:
  /// what a loop has slept through is not made up for.
  bool due(TimePoint now, Duration period) noexcept;

  /// When due() is asked next; never, while devices move with samples alone.
  TimePoint next() const noexcept { return next_; }

 private:
  TimePoint next_ = TimePoint::max();
};

}  // namespace tagwrench
