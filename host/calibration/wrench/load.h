// The load that a step of the plan stands for, with what is not known of it.
#pragma once

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

}  // namespace tagwrench
