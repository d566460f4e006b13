// The bookkeeping of a capture queue: sequence numbers, clocks, losses, staleness. Pure: time and
// stamps are passed in.
#pragma once

#include <cstdint>
#include <optional>

#include "host/core/types.h"

namespace tagwrench {

/// What the driver wrote on a buffer, and when we took it.
struct BufferStamp {
  std::uint32_t sequence = 0;
  TimePoint driver_time{};
  bool monotonic = false;  ///< the driver does not deny that driver_time is CLOCK_MONOTONIC
  TimePoint dequeued{};
};

class CaptureQueueTracker {
 public:
  /// `period` between frames decides what is stale.
  explicit CaptureQueueTracker(Duration period);

  /// The stream has started (again): the next buffer may be a left-over, and its number begins a
  /// new count.
  void stream_started() noexcept;
  /// The next frame noted has number 0 and nothing was lost before it.
  void number_from_zero() noexcept;

  /// Every buffer that was dequeued, in order. False: the first of a stream, discard it (drivers
  /// hand out an old picture there). `prompt`: it was waited for, so a driver clock that is far
  /// behind is a wrong clock.
  bool note(const BufferStamp& stamp, bool prompt) noexcept;

  /// Of the frame noted last.
  std::uint64_t sequence() const noexcept { return sequence_; }
  /// Of the frame noted last; strictly increasing. The driver's stamp while it is trusted, else
  /// when it was dequeued.
  TimePoint capture_time() const noexcept { return capture_time_; }

  /// Whether the frame noted last is too old to act on. `queue_was_full`: the driver had no buffer
  /// left to fill, so without its clock the age is only known to be less than the time since
  /// `last_drain`.
  bool stale(TimePoint now, TimePoint last_drain, bool queue_was_full) const noexcept;

  /// The frame noted last is handed on: how many were captured since the one handed on before it.
  std::uint32_t take() noexcept;

  /// False once stamps were not monotonic, lay in the future or were absurd; never becomes true
  /// again.
  bool trusts_driver_clock() const noexcept { return trusts_driver_clock_; }
  /// max(2 periods, 100 ms): a frame older than this is never handed on.
  Duration stale_after() const noexcept;

 private:
  Duration period_;
  std::uint64_t sequence_ = 0;
  std::uint32_t driver_sequence_ = 0;
  bool stream_is_new_ = true;
  bool have_driver_sequence_ = false;
  bool from_zero_ = true;
  bool trusts_driver_clock_ = true;
  TimePoint capture_time_{};
  std::optional<std::uint64_t> taken_;
};

}  // namespace tagwrench
