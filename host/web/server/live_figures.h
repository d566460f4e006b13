// How the frame loop runs, from the samples of the last second.
#pragma once

#include <cstdint>
#include <deque>

#include "host/core/types.h"

namespace tagwrench {

struct LiveFigures {
  double rate_hz = 0;  ///< samples handed to outputs
  std::int64_t latency_median_us = 0;
  std::int64_t latency_p99_us = 0;
  std::int64_t jitter_us = 0;  ///< standard deviation of the time between two hand-overs
  std::uint64_t frames = 0;    ///< since the feed began
  std::uint64_t dropped = 0;   ///< frames that the source lost, since then
};

class LiveWindow {
 public:
  void add(TimePoint output_time, std::int64_t latency_us);
  LiveFigures figures(TimePoint now) const;
  void clear() { entries_.clear(); }

 private:
  static constexpr Duration kSpan = std::chrono::seconds(1);
  static constexpr std::size_t kMax = 2000;
  struct Entry {
    TimePoint output_time;
    std::int64_t latency_us;
  };
  std::deque<Entry> entries_;
};

}  // namespace tagwrench
