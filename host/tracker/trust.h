// When a photometric fit deserves to be believed.
#pragma once

#include <cmath>

#include "host/tracker/photometric.h"

namespace tagwrench {

inline bool trusted(const PhotometricFit& fit, const PhotometricState& state) noexcept {
  /// Believing less of the template than this.
  constexpr double kMinGood = 0.3;
  /// Residuals of this part of the contrast, or a blur beyond what its expansion describes, px^2.
  constexpr double kMaxResidualFraction = 0.10;
  constexpr double kMaxBlur = 0.8;
  /// Standard deviations beyond these are of no use for a force: m, rad.
  constexpr double kDoubtTranslation = 0.3e-3;
  constexpr double kDoubtRotation = 0.03;
  const Vector6 sigma = fit.covariance.diagonal().cwiseMax(0.0).cwiseSqrt();
  return fit.good >= kMinGood && fit.residual_fraction < kMaxResidualFraction &&
         std::abs(state.blur[0]) < kMaxBlur && sigma.head<3>().maxCoeff() < kDoubtTranslation &&
         sigma.tail<3>().maxCoeff() < kDoubtRotation;
}

}  // namespace tagwrench
