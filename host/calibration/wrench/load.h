// The load that a step of the plan stands for, with what is not known of it; which loads a
// calibration has seen so far, and which are still guessed.
#pragma once

#include <string>
#include <vector>

#include "host/calibration/wrench/plan.h"
#include "host/core/types.h"
#include "host/wrench/fit.h"

namespace tagwrench {

/// What is known of a load: N, N m about the platform origin at rest, camera axes.
struct KnownLoad {
  Vector6 wrench = Vector6::Zero();
  Matrix6 covariance = Matrix6::Zero();
};

/// A mass that hangs from a point of the platform, which has moved with it: F = m g u, M = p x F.
/// Sets the wrench's part of the observation.
void set_hanging(const WrenchPlan& plan, int step, const Vector6& displacement,
                 Observation& observation);

/// What a load cell tells of a push along the step's line: N, its noise, and the relative standard
/// deviation of its calibration, common to all pushes.
struct CellForce {
  double value = 0;
  double noise = 0;
  double gain_sigma = 0;
};
void set_push(const WrenchPlan& plan, int step, const CellForce& force, const Vector6& displacement,
              Observation& observation);

/// What a six-axis reference tells (N, N m), moved from its own origin, axes and sign to the
/// platform's.
void set_six_axis(const WrenchPlan& plan, const Vector6& value, const Vector6& sigma,
                  Observation& observation);

/// A reading of a six-axis reference as a wrench on the platform.
Vector6 six_axis_wrench(const WrenchPlan& plan, const Vector6& value);

/// The load that a step is expected to bring, before it is measured; zero for rests and for
/// movements by hand.
KnownLoad expected_load(const WrenchPlan& plan, int step);

/// The displacement is linear in the load, so that each known load w tells the response along
/// itself: information w w^T / s^2 on every row of the compliance, where s is what is not known of
/// the load. With a prior from the spring model (the response along each axis is known to 30 %),
/// its inverse is the variance with which a load of full range along any direction would be told
/// (Bayesian linear regression: Gelman et al., Bayesian Data Analysis, 14.8).
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
  /// What a step will have told when it is done. Movements by hand are taken to load every axis to
  /// half of its range.
  void add_expected(const WrenchPlan& plan, int step);

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

/// What a plan will have covered when all is done.
WrenchCoverage coverage_of(const WrenchPlan& plan, const Vector6& range);

}  // namespace tagwrench
