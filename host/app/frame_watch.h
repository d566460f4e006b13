// When the next frame is missing, and what is neutral then: the loop by itself, and should the loop
// hang, the watchdog. Times are passed in.
#pragma once

#include <array>

#include "host/core/types.h"
#include "host/output/watchdog.h"

namespace tagwrench {

class FrameWatch {
 public:
  /// `period`: that the source announces. The watchdog is borrowed.
  FrameWatch(Watchdog& watchdog, Duration period) noexcept;

  void begin(TimePoint now) noexcept { last_arrival_ = now; }
  /// The median of three intervals counts: one hiccup does not delay the next neutral, a camera
  /// that slows down is believed.
  void frame_came(TimePoint now, Duration period) noexcept;
  /// When the frame after the last one is so late that it is missing.
  TimePoint missing_at() const noexcept;

  /// From here on the watchdog sends neutral, should the loop hang.
  void arm() noexcept;
  /// All is neutral.
  void stand_down() noexcept { watchdog_.stand_down(); }

 private:
  Watchdog& watchdog_;
  TimePoint last_arrival_{};
  std::array<Duration, 3> intervals_;  ///< the last three between frames
  Duration interval_;                  ///< to be expected, at least the announced period
};

}  // namespace tagwrench
