// A fit's data put in order (blocks, unknowns, natural scales, features), its weighted least
// squares, and the same without one block. Then what it leaves unexplained: outlier steps, the
// model's own error, residuals that hang together; steps that contradict the others, which few are
// wrong, or whether it is the fit's assumptions. Internal to the fit.
#pragma once

#include <Eigen/Core>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "host/wrench/fit.h"

namespace tagwrench::fit {

/// What is held out together.
struct Block {
  int step = 0;
  double from = 0, to = 0;
  std::vector<std::size_t> members;
  bool is_long = false;  ///< part of a push or a movement: its residuals hang together in time
};

/// An observation whose numbers are ready for the normal equations.
struct Row {
  Vector6 displacement, wrench;
  Matrix6 displacement_covariance, wrench_covariance;
  FeatureVector phi;
  FeatureJacobian jacobian;
  int zero = 0;                                 ///< 0, 1, ...
  int block = 0;                                ///< into Problem::blocks
  std::vector<std::pair<int, Vector6>> common;  ///< index and effect
  double load = 0;                              ///< squared, of the natural scales
  struct Product {
    int first = 0, second = 0;
    Vector6 effect;
  };
  std::vector<Product> products;
  /// Where the products of common errors are not told: variances that stand for them, what is
  /// common times its relative size.
  Vector6 second_order = Vector6::Zero();
};

/// Unknowns, in this order: M column by column (6 x features), an offset for each zero (6 each),
/// the common errors in their prior standard deviations.
struct Problem {
  FeatureSpec features;
  std::vector<Row> rows;
  std::vector<Block> blocks;
  std::vector<int> zeros;                 ///< Observation::zero of each
  std::vector<std::string> common_names;  ///< of each
  Vector6 scale;                          ///< of wrenches: largest force and torque, N, N m
  Vector6 motion_scale;                   ///< of displacements: largest of each, m, rad
  bool has_prior = false;
  Matrix6 reciprocity = Matrix6::Zero();  ///< standard deviation of K_ij - K_ji; 0: not assumed
  Eigen::MatrixXd prior_mean;             ///< 6 x features
  Eigen::MatrixXd prior_sigma;            ///< 6 x features

  int feature_columns() const { return static_cast<int>(prior_mean.cols()); }
  int zero_at(int zero) const { return 6 * (feature_columns() + zero); }
  int common_at(int common) const {
    return 6 * (feature_columns() + static_cast<int>(zeros.size())) + common;
  }
  int unknowns() const { return common_at(static_cast<int>(common_names.size())); }
};

/// Throws ConfigError for numbers that cannot be fitted.
Problem make_problem(std::span<const Observation> observations, std::span<const PathPoint> path,
                     const FeatureSpec& features, const std::optional<Matrix6>& prior,
                     double prior_width);

/// The same data with other features.
Problem with_features(const Problem& problem, std::span<const Observation> observations,
                      std::span<const PathPoint> path, const FeatureSpec& features);

/// Standard deviation of each entry of a stiffness: `width` times the geometric mean of the
/// stiffnesses of its two axes, the natural unit of an entry (|K_ij| <= sqrt(K_ii K_jj) in any
/// stable spring).
Matrix6 prior_sigma_of(const Matrix6& stiffness, double width);

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

Weighting equal_weights(const Problem& problem, const ErrorModel& error);

struct Normal {
  Eigen::MatrixXd information;
  Eigen::VectorXd right;
};

struct Solution {
  Eigen::VectorXd unknowns;
  Eigen::MatrixXd covariance;
  Normal total;                ///< the prior included
  std::vector<Normal> blocks;  ///< what each adds

  Matrix6 stiffness() const { return Eigen::Map<const Matrix6>(unknowns.data()); }
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

/// A solution with weights, error model and rejections that agree with its hold-out residuals.
struct Judged {
  Solution solution;
  Weighting weighting;
  std::vector<std::vector<Prediction>> held_out;  ///< by block
  std::vector<double> chi2;        ///< of each block's held-out residual, per degree of freedom
  bool too_many_outliers = false;  ///< so many steps disagree that none was rejected
};

/// `left_out`: blocks that are not used whatever they say.
Judged judge(const Problem& problem, const std::vector<bool>& left_out);

/// e^T (V + model's error)^-1 e for an error in the place of the prediction.
double chi2_of(const Problem& problem, const Prediction& held_out, const ErrorModel& model,
               const Vector6& error);

/// What makes the steps agree with each other. The least far-fetched is taken, in about this order:
/// all is as stated; K is not symmetric; the model is off by 1 % of full load; a step is wrong; the
/// model is off by 3 %; more steps are wrong.
struct Explanation {
  bool found = false;          ///< else nothing of all that does; the rest says nothing then
  bool reciprocal = true;      ///< with K = K^T as the problem assumes it
  std::vector<bool> left_out;  ///< by block: of the steps that are wrong
};

/// Leaves out whole steps, at most a quarter of those with a load, and none if another one might
/// be it as well.
Explanation explain(const Problem& problem);

/// Gives up reciprocity where the data speak against it; refuses where they do so grossly, or where
/// steps are wrong besides, as little then tells which: throws ConfigError. `problem` and
/// `warnings` are told of it.
Judged judge_explained(Problem& problem, const Explanation& explanation,
                       std::vector<std::string>& warnings);

}  // namespace tagwrench::fit
