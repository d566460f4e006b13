// A page's clock on the host's. Pure: times are passed in.
#pragma once

#include <optional>

#include "host/core/types.h"

namespace tagwrench {

class PageClock {
 public:
  /// The page was asked at `sent`, read `page_ms` (performance.now(), ms), and its answer was here
  /// at `received`, host clock. What cannot be a clock's reading is left out, and false.
  bool exchange(TimePoint sent, double page_ms, TimePoint received) noexcept;

  int exchanges() const noexcept { return exchanges_; }
  /// Nothing before the first exchange, or if `page_ms` is none of a clock's readings.
  std::optional<TimePoint> host_time(double page_ms) const noexcept;
  /// By how much host_time() may be wrong about what is now: half the shortest way there and back,
  /// and what both clocks have drifted apart since.
  Duration error() const noexcept;

 private:
  int exchanges_ = 0;
  Duration offset_{};  ///< host less page
  Duration half_{};    ///< of the way there and back
  TimePoint measured_{};
  TimePoint last_{};
};

}  // namespace tagwrench
