// Which loads a calibration has seen so far, and which are still guessed.
//
// The displacement is linear in the load, so that each known load w tells the response along
// itself: information w w^T / s^2 on every row of the compliance, where s is what is not known of
// the load. With a prior from the spring model (the response along each axis is known to 30 %), its
// inverse is the variance with which a load of full range along any direction would be told
// (Bayesian linear regression: Gelman et al., Bayesian Data Analysis, 14.8).
#pragma once

#include <array>
#include <string>
#include <vector>

#include "host/calibration/wrench/load.h"
#include "host/calibration/wrench/plan.h"
#include "host/core/types.h"

namespace tagwrench {

class WrenchCoverage {
 public:
  static constexpr double kPrior = 0.3;    ///< of full load, known from the springs alone
  static constexpr double kCovered = 0.1;  ///< of full load: better than this is measured

  /// `range`: full load per axis, N and N m.
  explicit WrenchCoverage(const Vector6& range);

  void add(const KnownLoad& load);
  /// Six-axis loads come by the hundred, each by the same instrument: all together count as one
  /// with this standard deviation, share of range.
  static constexpr double kMovementSigma = 0.02;
  void add_movement(const Matrix6& second_moment);

  /// Standard deviation with which a full load on each axis would be told, share of that load.
  Vector6 sigma() const;
  /// Share of what the springs leave open that is measured: 0..1 per axis.
  Vector6 covered() const;
  /// Whether every direction is measured.
  bool complete() const { return missing().empty(); }
  /// One line per direction that is not: "no load twists about z: Mz".
  std::vector<std::string> missing() const;
  /// How much the sum of the six variances would fall: 0..1.
  double gain(const KnownLoad& load) const;

 private:
  Matrix6 posterior() const;
  /// Relative load and its information along itself.
  Vector6 scaled(const KnownLoad& load) const;
  double relative_variance(const KnownLoad& load) const;

  Vector6 range_;
  Matrix6 information_;
};

/// What a plan will have covered when all is done. Movements by hand are taken to load every axis
/// to half of its range.
WrenchCoverage coverage_of(const WrenchPlan& plan, const Vector6& range);

}  // namespace tagwrench
