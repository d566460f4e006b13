#include "host/tools/camera_timing/page_clock.h"

#include <cmath>

namespace tagwrench {
namespace {

constexpr double kMax_ms = 1e12;  // thirty years: no page is older
constexpr double kDrift = 1e-4;   // two ordinary crystals, 50 ppm each

bool is_reading(double page_ms) {
  return std::isfinite(page_ms) && page_ms >= 0 && page_ms <= kMax_ms;
}

Duration from_ms(double ms) { return Duration(std::llround(1e6 * ms)); }

Duration drift(Duration since) {
  return Duration(std::llround(kDrift * static_cast<double>(since.count())));
}

}  // namespace

bool PageClock::exchange(TimePoint sent, double page_ms, TimePoint received) noexcept {
  if (!is_reading(page_ms) || received < sent) return false;
  ++exchanges_;
  last_ = received;
  const Duration half = (received - sent) / 2;
  if (exchanges_ > 1 && half > error()) return true;
  half_ = half;
  offset_ = (sent + half).time_since_epoch() - from_ms(page_ms);
  measured_ = received;
  return true;
}

std::optional<TimePoint> PageClock::host_time(double page_ms) const noexcept {
  if (exchanges_ == 0 || !is_reading(page_ms)) return std::nullopt;
  return TimePoint(from_ms(page_ms) + offset_);
}

Duration PageClock::error() const noexcept { return half_ + drift(last_ - measured_); }

}  // namespace tagwrench
