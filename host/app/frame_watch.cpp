#include "host/app/frame_watch.h"

#include <algorithm>

namespace tagwrench {
namespace {

using std::chrono::milliseconds;

// A frame is missing when it is this late. With the watchdog's delay both stay below 80 ms, the
// time after which robot teleoperation programs take a silent device for gone.
constexpr Duration kGrace = milliseconds(40);
constexpr Duration kWatchdogGrace = milliseconds(60);
// A camera that slows down in dim light is late, not lost; slower than this it is lost.
constexpr Duration kSlowestInterval = milliseconds(250);

}  // namespace

FrameWatch::FrameWatch(Watchdog& watchdog, Duration period) noexcept
    : watchdog_(watchdog), intervals_{period, period, period}, interval_(period) {}

void FrameWatch::frame_came(TimePoint now, Duration period) noexcept {
  intervals_ = {intervals_[1], intervals_[2], now - last_arrival_};
  last_arrival_ = now;
  std::array<Duration, 3> sorted = intervals_;
  std::sort(sorted.begin(), sorted.end());
  interval_ = std::clamp(sorted[1], period, std::max(period, kSlowestInterval));
}

TimePoint FrameWatch::missing_at() const noexcept { return last_arrival_ + interval_ + kGrace; }

void FrameWatch::arm() noexcept { watchdog_.expect_by(last_arrival_ + interval_ + kWatchdogGrace); }

}  // namespace tagwrench
