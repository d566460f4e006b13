// Whether the computer has slept (suspend to RAM, to disk) since the last look.
#pragma once

#include <ctime>

#include "host/core/types.h"

namespace tagwrench {

/// In all since it was switched on: what CLOCK_BOOTTIME counts and CLOCK_MONOTONIC does not.
inline Duration time_asleep() noexcept {
  timespec with{};
  timespec without{};
  ::clock_gettime(CLOCK_BOOTTIME, &with);
  ::clock_gettime(CLOCK_MONOTONIC, &without);
  return std::chrono::seconds(with.tv_sec - without.tv_sec) +
         std::chrono::nanoseconds(with.tv_nsec - without.tv_nsec);
}

class SleepWatch {
 public:
  explicit SleepWatch(Duration asleep) noexcept : asleep_(asleep) {}

  /// `asleep`: time_asleep() now. A second and more counts; between two clocks read one after the
  /// other a process may wait.
  bool woke(Duration asleep) noexcept {
    if (asleep - asleep_ < std::chrono::seconds(1)) return false;
    asleep_ = asleep;
    return true;
  }

 private:
  Duration asleep_;
};

}  // namespace tagwrench
