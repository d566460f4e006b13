// Which of the six axes a fit knows, and why not the others. Internal to the fit.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "host/core/axis_names.h"
#include "host/wrench/fit_solve.h"

namespace tagwrench::fit {

struct AxisKnowledge {
  bool reached = false;   ///< the answer to a load along this axis is known
  double coverage = 0;    ///< 1 - standard deviation after over before
  double gain_sigma = 0;  ///< relative
};

/// How well the answers to loads along each axis are known. `K`: the fitted stiffness;
/// `covariance`: of all unknowns.
std::array<AxisKnowledge, 6> axis_knowledge(const Problem& problem, const Matrix6& K,
                                            const Eigen::MatrixXd& covariance);

/// Combinations of axes along which no load acted, each a unit vector in natural scales. `weight`:
/// of blocks.
std::vector<Vector6> missing_loads(const Problem& problem, const std::vector<double>& weight);

/// "Mz"; "Fx and My apart from each other".
std::string missing_name(const Vector6& combination);

/// "no torque about z was applied".
std::string missing_reason(int axis, const std::vector<Vector6>& missing, double gain_sigma);

}  // namespace tagwrench::fit
