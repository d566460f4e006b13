#include "host/calibration/check/focus_guide.h"

#include <algorithm>
#include <cmath>

namespace tagwrench {
namespace {

constexpr Duration kLookBack = std::chrono::seconds(1);
constexpr Duration kMinLook = std::chrono::milliseconds(300);
constexpr double kTurned = 1.06;  // ratio of widths that says that somebody turns
constexpr double kAway = 1.10;    // from the best
constexpr double kWorse = 1.20;   // than the best: there is nothing to be found on that side
constexpr double kClear = 0.97;   // a new dip, and not the old one once more

}  // namespace

void FocusGuide::add(TimePoint time, double width_px, unsigned tags) {
  if (tags != tags_) *this = {};
  tags_ = tags;
  // One frame alone may be wrong.
  const double held_px = seen_.empty() ? width_px : std::max(width_px, seen_.back().width_px);
  now_px_ = width_px;
  best_px_ = best_px_ > 0 ? std::min(best_px_, held_px) : held_px;
  if (worst_since_px_ > 0 && best_px_ < kClear * dip_px_) {
    worst_before_px_ = std::max(worst_before_px_, worst_since_px_);
    worst_since_px_ = 0;
  }
  if (worst_since_px_ == 0) dip_px_ = best_px_;
  worst_since_px_ = std::max(worst_since_px_, width_px);
  seen_.push_back({time, width_px});
  std::erase_if(seen_, [&](const Seen& s) { return time - s.time > kLookBack; });
  const Seen& before = seen_.front();
  if (time - before.time < kMinLook) {
    turn_ = FocusTurn::begin;
  } else if (width_px * kTurned < before.width_px) {
    turn_ = FocusTurn::sharper;
  } else if (width_px > kTurned * before.width_px) {
    turn_ = FocusTurn::blurrier;
  } else if (width_px > kAway * best_px_) {
    turn_ = FocusTurn::away;
  } else {
    const bool between = std::min(worst_before_px_, worst_since_px_) > kWorse * best_px_;
    turn_ = between ? FocusTurn::best : FocusTurn::try_on;
  }
}

double FocusGuide::more_noise() const {
  constexpr double kPixelVariance = 1.0 / 12;
  const double now = now_px_ * now_px_ + kPixelVariance;
  const double best = best_px_ * best_px_ + kPixelVariance;
  return best_px_ > 0 ? std::max(0.0, std::pow(now / best, 0.25) - 1) : 0;
}

}  // namespace tagwrench
