#include "host/motion/axis_filter.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace tagwrench {
namespace {

/// Of a low pass of first order, for a step of `seconds`.
double weight_of_cutoff(double cutoff_hz, double seconds) {
  return 1 / (1 + 1 / (2 * std::numbers::pi * cutoff_hz * seconds));
}

}  // namespace

void AxisFilter::start(const Vector6& value) noexcept {
  smooth_ = last_ = value;
  speed_.setZero();
}

const Vector6& AxisFilter::step(double seconds, const Vector6& value) noexcept {
  smooth_ += weight(seconds, value) * (value - smooth_);
  last_ = value;
  return smooth_;
}

double AxisFilter::weight(double seconds, const Vector6& value) noexcept {
  switch (options_.kind) {
    case FilterKind::none:
      return 1;
    case FilterKind::exponential:
      return 1 - std::pow(1 - options_.weight, seconds * options_.weight_hz);
    case FilterKind::one_euro: {
      const Vector6 speed = (value - last_).cwiseQuotient(full_scale_) / seconds;
      speed_ += weight_of_cutoff(options_.speed_cutoff_hz, seconds) * (speed - speed_);
      const double fastest = speed_.cwiseAbs().maxCoeff();
      return weight_of_cutoff(options_.cutoff_hz + options_.hz_per_speed * fastest, seconds);
    }
  }
  return 1;
}

namespace {

constexpr double kMemory = 2;             // s
constexpr double kUnequalSteps = 1.5;     // beyond this ratio second differences are no measure
constexpr double kSecondDifferences = 6;  // their variance, times that of one value: 1 + 4 + 1

}  // namespace

void NoiseFloor::add(double seconds, const Vector6& value, const Vector6& sigma,
                     bool rest) noexcept {
  const Vector6 variance = sigma.allFinite() ? sigma.cwiseAbs2().eval() : stated_;
  if (!any_) stated_ = variance;  // better than nothing, should somebody push already
  any_ = true;
  if (!rest) {
    known_ = 0;
  } else {
    const double weight = 1 - std::exp(-seconds / kMemory);
    stated_ += weight * (variance - stated_);
    learn_scatter(seconds, weight, value);
  }
  sigma_ = stated_.cwiseMax(scatter_).cwiseSqrt();
}

void NoiseFloor::learn_scatter(double seconds, double weight, const Vector6& value) noexcept {
  const double longer = std::max(seconds, last_step_);
  const double shorter = std::min(seconds, last_step_);
  if (known_ == 2 && longer <= kUnequalSteps * shorter) {
    const Vector6 second = value - 2 * values_[0] + values_[1];
    scatter_ += weight * (second.cwiseAbs2() / kSecondDifferences - scatter_);
  }
  values_ = {value, values_[0]};
  known_ = std::min(known_ + 1, 2);
  last_step_ = seconds;
}

}  // namespace tagwrench
