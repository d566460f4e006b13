// The weighted least squares of a fit, and the same without one block. Internal to the fit.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "host/wrench/fit_problem.h"

namespace tagwrench::fit {

inline constexpr double kConstantFraction = 0.1;  ///< of the model's error, without load

/// What noise and reference do not explain: variance constant^2 + proportional^2 * Row::load.
struct ErrorModel {
  Vector6 constant = Vector6::Zero();      ///< N, N m
  Vector6 proportional = Vector6::Zero();  ///< N, N m at a load of one natural scale

  Vector6 variance(double load) const {
    return constant.cwiseAbs2() + load * proportional.cwiseAbs2();
  }
};

struct Weighting {
  ErrorModel error;
  std::vector<double> block;  ///< weight of each; 0: rejected
  double dispersion = 1;      ///< of long blocks: how much less they tell than so many independent
                              ///< frames would
};

struct Normal {
  Eigen::MatrixXd information;
  Eigen::VectorXd right;
};

struct Solution {
  Eigen::VectorXd unknowns;
  Eigen::MatrixXd covariance;
  Normal total;                ///< the prior included
  std::vector<Normal> blocks;  ///< what each adds
};

/// Wrench minus what the model says, with the common errors as estimated.
Vector6 residual(const Problem& problem, const Row& row, const Eigen::VectorXd& unknowns);

/// Of a residual: the reference's own errors and the tracker's, without the model's error.
Matrix6 effective_covariance(const Problem& problem, const Row& row,
                             const Eigen::VectorXd& unknowns);

/// J C J^T, J the derivative of a prediction with respect to the unknowns.
Matrix6 prediction_covariance(const Problem& problem, const Row& row,
                              const Eigen::MatrixXd& covariance);

/// Iteratively reweighted. `start`: unknowns of an earlier solution, or empty.
Solution solve(const Problem& problem, const Weighting& weighting, const Eigen::VectorXd& start);

/// A block predicted by the others.
struct Prediction {
  std::size_t row = 0;
  Vector6 error;       ///< wrench minus prediction
  Matrix6 covariance;  ///< of it, without the model's error
};

/// One list a block, weights frozen at the solution's.
std::vector<std::vector<Prediction>> hold_out(const Problem& problem, const Solution& solution);

/// As hold_out, the errors alone, row by row.
std::vector<Vector6> hold_out_errors(const Problem& problem, const Solution& solution);

}  // namespace tagwrench::fit
