#include "host/wrench/features.h"

#include <algorithm>
#include <cmath>

namespace tagwrench {

Features::Features(const FeatureSpec& spec)
    : spec_(spec),
      values_(FeatureVector::Zero(feature_count(spec.kind))),
      jacobian_(FeatureJacobian::Zero(feature_count(spec.kind), 6)) {
  jacobian_.topRows<6>().setIdentity();
}

void Features::reset() noexcept {
  memory_.setZero();
  values_.setZero();
}

void Features::update(const Vector6& displacement, double dt) noexcept {
  values_.head<6>() = displacement;
  switch (spec_.kind) {
    case FeatureKind::linear:
      return;
    case FeatureKind::quadratic: {
      int row = 6;
      for (int j = 0; j < 6; ++j) {
        for (int k = j; k < 6; ++k, ++row) {
          values_[row] = displacement[j] * displacement[k];
          jacobian_.row(row).setZero();
          jacobian_(row, j) += displacement[k];
          jacobian_(row, k) += displacement[j];
        }
      }
      return;
    }
    case FeatureKind::creep: {
      // Exact for a displacement that is constant over dt.
      const double gain = dt > 0 ? -std::expm1(-dt / spec_.time_constant) : 0.0;
      memory_ += gain * (displacement - memory_);
      values_.tail<6>() = memory_;
      jacobian_.bottomRows<6>().diagonal().setConstant(gain);
      return;
    }
    case FeatureKind::hysteresis: {
      for (int j = 0; j < 6; ++j) {
        const double before = memory_[j];
        memory_[j] =
            std::clamp(before, displacement[j] - spec_.play[j], displacement[j] + spec_.play[j]);
        jacobian_(6 + j, j) = memory_[j] == before ? 0.0 : 1.0;
      }
      values_.tail<6>() = memory_;
      return;
    }
  }
}

}  // namespace tagwrench
