#include "host/motion/motion_extrapolator.h"

#include <algorithm>
#include <cmath>

namespace tagwrench {
namespace {

constexpr double kOfLate = 0.06;  // s
constexpr double kLeft = 0.1;     // of a push: it is gone
constexpr double kMargin = 1.15;  // of its size: axes swing into each other
constexpr double kMin = 0.02;

}  // namespace

void RingdownSuppressor::reset() noexcept {
  size_ = 0;
  push_.setZero();
}

void RingdownSuppressor::add(double seconds, const Vector6& push) noexcept {
  if (decay_ <= 0) return;
  size_ *= std::exp(-seconds / decay_);
  if (push.dot(push_) <= kLeft * push_.squaredNorm())
    size_ = std::max(size_, kMargin * push_.norm());
  if (size_ < kMin) size_ = 0;
  push_ *= std::exp(-seconds / kOfLate);
  if (push.squaredNorm() > push_.squaredNorm()) push_ = push;
}

namespace {

constexpr double kFarthest = 1.5;     // frame periods
constexpr double kMaxOfMotion = 0.3;  // that it goes on by
constexpr double kCaution = 2.5;      // times the growth of deceleration

double seconds(Duration time) { return std::chrono::duration<double>(time).count(); }

/// How far motion goes on within `ahead` periods, in a period's worth of slope; from its slopes
/// over the last three intervals. Nothing, if they disagree about the direction. The slope is at
/// most that of the interval before, falls as fast as it does now and, if ever faster, faster
/// still; and when it is used up motion stays.
double carry(double now, double before, double long_before, double ahead) {
  if (now * before <= 0 || before * long_before <= 0) return 0;
  const double a = std::abs(now);
  const double b = std::abs(before);
  const double c = std::abs(long_before);
  const double growth = std::min(0.0, (a - b) - (b - c));
  const double change = std::min(0.0, a - b + kCaution * growth);
  const double slope = std::min(a + change / 2, b);
  if (slope <= 0) return 0;
  const double within = change < 0 ? std::min(ahead, -slope / change) : ahead;
  return std::copysign(slope * within + change * within * within / 2, now);
}

}  // namespace

void MotionExtrapolator::add(TimePoint time, const Vector6& motion) noexcept {
  if (frames_ > 0) {
    const double interval = seconds(time - time_);
    intervals_ = {interval, intervals_[0], intervals_[1]};
    slopes_ = {(motion - motion_) / interval, slopes_[0], slopes_[1]};
  }
  time_ = time;
  motion_ = motion;
  frames_ = std::min(frames_ + 1, 4);
}

Vector6 MotionExtrapolator::at(TimePoint time, const Vector6& limit) const noexcept {
  if (frames_ < 4 || time <= time_) return motion_;
  // The shortest interval: a lost frame does not make the period longer.
  const double period = *std::min_element(intervals_.begin(), intervals_.end());
  const double ahead = std::min(seconds(time - time_) / period, kFarthest);
  Vector6 carried;
  for (int i = 0; i < 6; ++i) {
    const double most = kMaxOfMotion * std::abs(motion_[i]);
    const double on = period * carry(slopes_[0][i], slopes_[1][i], slopes_[2][i], ahead);
    const double size = std::min(std::abs(motion_[i] + std::clamp(on, -most, most)), limit[i]);
    carried[i] = motion_[i] == 0 ? 0 : std::copysign(size, motion_[i]);
  }
  return carried;
}

}  // namespace tagwrench
