// What a wrench is linear in: the displacement alone, or with its products, its recent past, or its
// turning points.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <string_view>

#include "host/core/types.h"

namespace tagwrench {

enum class FeatureKind : std::uint8_t {
  linear,      ///< d
  quadratic,   ///< d and the 21 products d_j d_k, j <= k
  creep,       ///< d and d low-passed with one time constant: a standard linear solid, whose force
               ///< is a sum of both
  hysteresis,  ///< d and the play operator of each coordinate (Visintin, Differential Models of
               ///< Hysteresis, 1994, ch. III)
};

constexpr int kFeatureKinds = 4;
constexpr int kMaxFeatures = 27;

constexpr std::string_view name(FeatureKind kind) {
  switch (kind) {
    case FeatureKind::linear:
      return "linear";
    case FeatureKind::quadratic:
      return "quadratic";
    case FeatureKind::creep:
      return "creep";
    case FeatureKind::hysteresis:
      return "hysteresis";
  }
  return "?";
}

constexpr int feature_count(FeatureKind kind) {
  return kind == FeatureKind::linear ? 6 : kind == FeatureKind::quadratic ? 27 : 12;
}

struct FeatureSpec {
  FeatureKind kind = FeatureKind::linear;
  double time_constant = 0;        ///< of creep, s
  Vector6 play = Vector6::Zero();  ///< of hysteresis: half width, m, rad
};

/// The first six are the displacement.
using FeatureVector = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, kMaxFeatures, 1>;
using FeatureJacobian = Eigen::Matrix<double, Eigen::Dynamic, 6, 0, kMaxFeatures, 6>;

/// Turns one displacement after the other into features. No heap after construction.
class Features {
 public:
  explicit Features(const FeatureSpec& spec);

  /// `dt` seconds after the one before; 0 for the first, at which the memory is that of a platform
  /// that has always been at rest.
  void update(const Vector6& displacement, double dt) noexcept;
  const FeatureVector& values() const { return values_; }
  /// d values / d displacement, the past held.
  const FeatureJacobian& jacobian() const { return jacobian_; }
  void reset() noexcept;

 private:
  FeatureSpec spec_;
  Vector6 memory_ = Vector6::Zero();
  FeatureVector values_;
  FeatureJacobian jacobian_;
};

}  // namespace tagwrench
