#include "host/motion/noise_floor.h"

#include <algorithm>
#include <cmath>

namespace tagwrench {
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
