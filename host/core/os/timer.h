// Timers of the monotonic clock as file descriptors, for loops that poll.
#pragma once

#include <sys/timerfd.h>

#include <algorithm>
#include <chrono>

#include "host/core/os/unique_fd.h"
#include "host/core/types.h"

namespace tagwrench {

/// Readable once it has gone off. None (see errno) where the kernel gives no more.
inline UniqueFd monotonic_timer() noexcept {
  return UniqueFd(::timerfd_create(CLOCK_MONOTONIC, TFD_NONBLOCK | TFD_CLOEXEC));
}

inline timespec to_timespec(Duration time) noexcept {
  const auto seconds = std::chrono::duration_cast<std::chrono::seconds>(time);
  return {static_cast<time_t>(seconds.count()), static_cast<long>((time - seconds).count())};
}

/// Goes off at this time; at once if it has passed.
inline void wake_at(const UniqueFd& timer, TimePoint time) noexcept {
  const Duration at = std::max(time.time_since_epoch(), Duration(1));  // 0 would stop the timer
  const itimerspec when{{}, to_timespec(at)};
  ::timerfd_settime(timer.get(), TFD_TIMER_ABSTIME, &when, nullptr);
}

/// Goes off after this time, and then at every `every`; 0: not again.
inline void wake_after(const UniqueFd& timer, Duration after, Duration every = {}) noexcept {
  const itimerspec when{to_timespec(every), to_timespec(after)};
  ::timerfd_settime(timer.get(), 0, &when, nullptr);
}

}  // namespace tagwrench
