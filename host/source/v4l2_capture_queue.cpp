#include "host/source/v4l2_capture_queue.h"

#include <algorithm>
#include <limits>

namespace tagwrench {
namespace {

using namespace std::chrono_literals;

/// A larger jump is a driver's mistake: the source would have been called stalled long before.
constexpr std::uint32_t kMaxGap = 4096;
constexpr Duration kAbsurdAge = 1s;

}  // namespace

CaptureQueueTracker::CaptureQueueTracker(Duration period) : period_(period) {}

void CaptureQueueTracker::stream_started() noexcept {
  stream_is_new_ = true;
  have_driver_sequence_ = false;
}

void CaptureQueueTracker::number_from_zero() noexcept {
  from_zero_ = true;
  taken_.reset();
}

bool CaptureQueueTracker::note(const BufferStamp& stamp, bool prompt) noexcept {
  if (stream_is_new_) {
    stream_is_new_ = false;
    return false;
  }
  // Unsigned difference: right across the wrap at 2^32. A number that stands still or jumps back
  // says nothing.
  const std::uint32_t step = stamp.sequence - driver_sequence_;
  const bool usable = have_driver_sequence_ && step >= 1 && step <= kMaxGap;
  driver_sequence_ = stamp.sequence;
  have_driver_sequence_ = true;
  sequence_ = from_zero_ ? 0 : sequence_ + (usable ? step : 1);
  from_zero_ = false;

  const Duration age = stamp.dequeued - stamp.driver_time;
  if (!stamp.monotonic || age < 0ns || (prompt && age > kAbsurdAge)) trusts_driver_clock_ = false;
  const TimePoint time = trusts_driver_clock_ ? stamp.driver_time : stamp.dequeued;
  capture_time_ = std::max(time, capture_time_ + 1ns);
  return true;
}

Duration CaptureQueueTracker::stale_after() const noexcept {
  return std::max<Duration>(2 * period_, 100ms);
}

bool CaptureQueueTracker::stale(TimePoint now, TimePoint last_drain,
                                bool queue_was_full) const noexcept {
  if (now - capture_time_ > stale_after()) return true;
  return !trusts_driver_clock_ && queue_was_full && now - last_drain > stale_after();
}

std::uint32_t CaptureQueueTracker::take() noexcept {
  const std::uint64_t lost = taken_ ? sequence_ - *taken_ - 1 : 0;
  taken_ = sequence_;
  return static_cast<std::uint32_t>(
      std::min<std::uint64_t>(lost, std::numeric_limits<std::uint32_t>::max()));
}

}  // namespace tagwrench
