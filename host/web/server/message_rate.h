// Counts what comes in a second. Pure.
#pragma once

#include <array>
#include <cstddef>

#include "host/core/types.h"

namespace tagwrench {

template <std::size_t kMax>
class MessageRate {
 public:
  /// False: it is more than kMax in the last second.
  bool count(TimePoint now) noexcept {
    TimePoint& oldest = times_[next_];
    const bool too_many = full_ && now - oldest < std::chrono::seconds(1);
    oldest = now;
    next_ = (next_ + 1) % kMax;
    full_ = full_ || next_ == 0;
    return !too_many;
  }

 private:
  std::array<TimePoint, kMax> times_{};
  std::size_t next_ = 0;
  bool full_ = false;
};

}  // namespace tagwrench
