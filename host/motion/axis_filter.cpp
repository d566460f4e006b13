#include "host/motion/axis_filter.h"

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

}  // namespace tagwrench
