#include "host/board/counter_clock.h"

#include <algorithm>
#include <cmath>

namespace tagwrench::link {
namespace {

constexpr double kFirstJitter = 5e-3;  ///< s, before any is seen
constexpr double kMinJitter = 20e-6;   ///< s
constexpr double kPeriodSigma = 0.02;  ///< of the nominal period
constexpr double kWander = 1e-6;       ///< of the period, relative, per square root of a second
constexpr double kForget = 0.02;       ///< of the jitter's estimate, per sample
constexpr double kGate = 36;           ///< squared innovation over its variance
constexpr double kMisfitTime = 0.5;    ///< s
constexpr double kMaxSteps = 30'000;   ///< half of the counter's range: a bridge of a long silence

Duration to_duration(double seconds) {
  return Duration(std::llround(std::clamp(seconds, -1e9, 1e9) * 1e9));
}

}  // namespace

void CounterClock::start(std::uint16_t counter, TimePoint arrival) noexcept {
  known_ = true;
  reference_ = arrival;
  state_ << 0, nominal_;
  const double period_sigma = kPeriodSigma * nominal_;
  jitter_variance_ = kFirstJitter * kFirstJitter;
  covariance_ << jitter_variance_, 0, 0, period_sigma * period_sigma;
  last_ = counter;
  misfits_ = 0;
}

HostTime CounterClock::now() const noexcept {
  const Duration sigma = to_duration(std::sqrt(covariance_(0, 0)));
  return {reference_ + to_duration(state_[0]), sigma, sigma};
}

HostTime CounterClock::take(std::uint16_t counter, TimePoint arrival) noexcept {
  if (!known_) {
    start(counter, arrival);
    return now();
  }
  const double arrived = std::chrono::duration<double>(arrival - reference_).count();
  const auto difference = static_cast<std::uint16_t>(counter - last_);
  const double steps = difference;
  last_ = counter;
  if (difference == 0 || steps > kMaxSteps) {
    start(counter, arrival);
    ++restarts_;
    return now();
  }
  Eigen::Matrix2d step;
  step << 1, steps, 0, 1;
  state_ = (step * state_).eval();
  covariance_ = (step * covariance_ * step.transpose()).eval();
  const double wander = kWander * nominal_;
  covariance_(1, 1) += wander * wander * steps * nominal_;

  const double innovation = arrived - state_[0];
  const double variance = covariance_(0, 0) + jitter_variance_;
  if (innovation * innovation > kGate * variance) {
    if (++misfits_ * steps * nominal_ > kMisfitTime) {
      start(counter, arrival);
      ++restarts_;
    }
    return now();
  }
  misfits_ = 0;
  const Eigen::Vector2d gain = covariance_.col(0) / variance;
  state_ += gain * innovation;
  covariance_ = (covariance_ - gain * covariance_.row(0)).eval();
  jitter_variance_ += kForget * (innovation * innovation - jitter_variance_);
  jitter_variance_ = std::max(jitter_variance_, kMinJitter * kMinJitter);
  return now();
}

}  // namespace tagwrench::link
