#include "host/app/output_scheduler.h"

namespace tagwrench {

OutputScheduler::Move OutputScheduler::sample(bool numbers, Duration period,
                                              TimePoint now) noexcept {
  if (!numbers || period <= Duration::zero()) {
    next_ = TimePoint::max();
    return Move::with_sample;
  }
  if (next_ == TimePoint::max()) next_ = now;  // at once, and from then on by the clock
  return due(now, period) ? Move::on : Move::none;
}

bool OutputScheduler::due(TimePoint now, Duration period) noexcept {
  if (now < next_) return false;
  next_ = now - next_ > period ? now + period : next_ + period;
  return true;
}

}  // namespace tagwrench
