#include "host/wrench/fit_solve.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "host/core/config_error.h"

namespace tagwrench::fit {
namespace {

constexpr int kMaxIterations = 12;
constexpr double kConverged = 1e-9;  // of the scaled unknowns
constexpr double kFloor = 3e-5;      // of full load: no bench is better
constexpr double kVagueOffset = 10;  // of full load

auto matrix_of(const Problem& problem, const Eigen::VectorXd& unknowns) {
  return Eigen::Map<const Eigen::Matrix<double, 6, Eigen::Dynamic>>(unknowns.data(), 6,
                                                                    problem.feature_columns());
}

Vector6 offset_of(const Problem& problem, const Row& row, const Eigen::VectorXd& unknowns) {
  return unknowns.segment<6>(problem.zero_at(row.zero));
}

/// The row with its products of common errors taken at `unknowns`: they become part of the wrench
/// and of the common errors' effects.
Row linearised(const Problem& problem, const Row& row, const Eigen::VectorXd& unknowns) {
  Row out = row;
  for (const Row::Product& product : row.products) {
    const double a = unknowns[problem.common_at(product.first)];
    const double b = unknowns[problem.common_at(product.second)];
    out.wrench -= a * b * product.effect;
    for (auto& [index, effect] : out.common) {
      if (index == product.first) effect += b * product.effect;
      if (index == product.second) effect += a * product.effect;
    }
  }
  return out;
}

Normal prior_normal(const Problem& problem) {
  const int n = problem.unknowns();
  Normal prior{Eigen::MatrixXd::Zero(n, n), Eigen::VectorXd::Zero(n)};
  for (int k = 0; k < problem.feature_columns(); ++k) {
    for (int i = 0; i < 6; ++i) {
      const double weight = 1 / (problem.prior_sigma(i, k) * problem.prior_sigma(i, k));
      prior.information(6 * k + i, 6 * k + i) = weight;
      prior.right[6 * k + i] = weight * problem.prior_mean(i, k);
    }
  }
  for (int i = 0; i < 6; ++i) {
    for (int j = 0; j < i; ++j) {
      if (problem.reciprocity(i, j) == 0) continue;
      const double weight = 1 / (problem.reciprocity(i, j) * problem.reciprocity(i, j));
      const int one = 6 * j + i, other = 6 * i + j;
      prior.information(one, one) += weight;
      prior.information(other, other) += weight;
      prior.information(one, other) -= weight;
      prior.information(other, one) -= weight;
    }
  }
  for (int z = 0; z < static_cast<int>(problem.zeros.size()); ++z) {
    prior.information.diagonal().segment<6>(problem.zero_at(z)) =
        (kVagueOffset * problem.scale).cwiseAbs2().cwiseInverse();
  }
  for (int c = problem.common_at(0); c < n; ++c) prior.information(c, c) = 1;
  return prior;
}

/// Adds J^T W J and J^T W y of one row; J = [phi^T (x) I, I at its offset, -effects].
void add_row(const Problem& problem, const Row& row, const FeatureVector& phi, const Vector6& y,
             const Matrix6& W, Normal& to) {
  const int columns = problem.feature_columns();
  const int offset = problem.zero_at(row.zero);
  const Vector6 Wy = W * y;
  const auto at = [&](int k) { return k < columns ? 6 * k : offset; };
  const auto value = [&](int k) { return k < columns ? phi[k] : 1.0; };
  for (int k = 0; k <= columns; ++k) {
    to.right.segment<6>(at(k)) += value(k) * Wy;
    for (int l = 0; l <= k; ++l)
      to.information.block<6, 6>(at(k), at(l)) += value(k) * value(l) * W;
  }
  for (const auto& [index, effect] : row.common) {
    const int c = problem.common_at(index);
    const Vector6 We = W * effect;
    to.right[c] -= effect.dot(Wy);
    for (int k = 0; k <= columns; ++k)
      to.information.block<1, 6>(c, at(k)) -= value(k) * We.transpose();
    for (const auto& [other, its_effect] : row.common) {
      if (other <= index) to.information(c, problem.common_at(other)) += We.dot(its_effect);
    }
  }
}

Matrix6 inverse(const Matrix6& covariance) {
  const Eigen::LLT<Matrix6> llt(covariance);
  if (llt.info() != Eigen::Success)
    throw ConfigError("calibration: an observation's covariance is no covariance; redo its step");
  return llt.solve(Matrix6::Identity());
}

Eigen::LLT<Eigen::MatrixXd> factor(const Eigen::MatrixXd& information) {
  Eigen::LLT<Eigen::MatrixXd> llt(information);  // reads the lower triangle
  if (llt.info() != Eigen::Success) {
    throw ConfigError(
        "calibration: the observations contradict their covariances beyond arithmetic; take the "
        "steps again");
  }
  return llt;
}

/// The estimate from all but one block.
struct Rest {
  Eigen::VectorXd unknowns;
  Eigen::MatrixXd covariance;
};

Rest without(const Problem& problem, const Solution& solution, std::size_t b) {
  const Block& block = problem.blocks[b];
  const Normal& normal = solution.blocks[b];
  const Eigen::VectorXd right = solution.total.right - normal.right;
  if (block.members.size() == 1) {
    // J^T W J has rank six, so that the inverse of the rest is an update of rank six (Sherman,
    // Morrison, Woodbury). W and J^T W stand where its offset is, as J is the identity there.
    const int offset = problem.zero_at(problem.rows[block.members[0]].zero);
    const Matrix6 W = normal.information.block<6, 6>(offset, offset);
    if (W.isZero(0)) return {solution.unknowns, solution.covariance};
    const Eigen::MatrixXd CJW = solution.covariance * normal.information.middleCols<6>(offset);
    const Matrix6 left = W - normal.information.middleCols<6>(offset).transpose() * CJW;
    Rest rest;
    rest.covariance = solution.covariance + CJW * left.ldlt().solve(CJW.transpose());
    rest.unknowns = rest.covariance * right;
    return rest;
  }
  const auto llt = factor(solution.total.information - normal.information);
  return {llt.solve(right), llt.solve(Eigen::MatrixXd::Identity(right.size(), right.size()))};
}

}  // namespace

Vector6 residual(const Problem& problem, const Row& row, const Eigen::VectorXd& unknowns) {
  Vector6 r =
      row.wrench - matrix_of(problem, unknowns) * row.phi - offset_of(problem, row, unknowns);
  const auto common = [&](int index) { return unknowns[problem.common_at(index)]; };
  for (const auto& [index, effect] : row.common) r += effect * common(index);
  for (const Row::Product& product : row.products)
    r += product.effect * common(product.first) * common(product.second);
  return r;
}

Matrix6 effective_covariance(const Problem& problem, const Row& row,
                             const Eigen::VectorXd& unknowns) {
  const Matrix6 tangent = matrix_of(problem, unknowns) * row.jacobian;
  Matrix6 S = row.wrench_covariance + tangent * row.displacement_covariance * tangent.transpose();
  S.diagonal() += (kFloor * problem.scale).cwiseAbs2() + row.second_order;
  return S;
}

Matrix6 prediction_covariance(const Problem& problem, const Row& row,
                              const Eigen::MatrixXd& covariance) {
  const int columns = problem.feature_columns();
  // J C, then times J^T.
  Eigen::Matrix<double, 6, Eigen::Dynamic> JC = covariance.middleRows<6>(problem.zero_at(row.zero));
  for (int k = 0; k < columns; ++k) JC += row.phi[k] * covariance.middleRows<6>(6 * k);
  for (const auto& [index, effect] : row.common)
    JC -= effect * covariance.row(problem.common_at(index));
  Matrix6 out = JC.middleCols<6>(problem.zero_at(row.zero));
  for (int k = 0; k < columns; ++k) out += row.phi[k] * JC.middleCols<6>(6 * k);
  for (const auto& [index, effect] : row.common)
    out -= JC.col(problem.common_at(index)) * effect.transpose();
  return (out + out.transpose()) / 2;
}

Solution solve(const Problem& problem, const Weighting& weighting, const Eigen::VectorXd& start) {
  const int n = problem.unknowns();
  const Normal prior = prior_normal(problem);
  Solution solution;
  solution.unknowns = Eigen::VectorXd::Zero(n);
  if (start.size() == n) {
    solution.unknowns = start;
  } else {
    Eigen::Map<Eigen::MatrixXd>(solution.unknowns.data(), 6, problem.feature_columns()) =
        problem.prior_mean;
  }
  for (int iteration = 0; iteration < kMaxIterations; ++iteration) {
    const bool adjust = iteration > 0 || start.size() == n;
    solution.total = prior;
    solution.blocks.assign(problem.blocks.size(),
                           {Eigen::MatrixXd::Zero(n, n), Eigen::VectorXd::Zero(n)});
    for (const Row& row : problem.rows) {
      const Block& block = problem.blocks[static_cast<std::size_t>(row.block)];
      const double weight = weighting.block[static_cast<std::size_t>(row.block)] /
                            (block.is_long ? weighting.dispersion : 1.0);
      if (weight == 0) continue;
      const Matrix6 tangent = matrix_of(problem, solution.unknowns) * row.jacobian;
      Matrix6 S = effective_covariance(problem, row, solution.unknowns);
      // The displacement that the fit believes in, and the wrench to go with it. The model's error
      // is left to the displacement: else an axis that was never loaded explains its noise best by
      // having no stiffness.
      Vector6 shift = Vector6::Zero();
      if (adjust) {
        shift = row.displacement_covariance * tangent.transpose() * inverse(S) *
                residual(problem, row, solution.unknowns);
      }
      S.diagonal() += weighting.error.variance(row.load);
      const Matrix6 W = inverse(S);
      const Row at = linearised(problem, row, solution.unknowns);
      add_row(problem, at, row.phi + row.jacobian * shift, at.wrench + tangent * shift, weight * W,
              solution.blocks[static_cast<std::size_t>(row.block)]);
    }
    for (Normal& block : solution.blocks) {
      block.information.triangularView<Eigen::StrictlyUpper>() = block.information.transpose();
      solution.total.information += block.information;
      solution.total.right += block.right;
    }
    const auto llt = factor(solution.total.information);
    const Eigen::VectorXd next = llt.solve(solution.total.right);
    const Eigen::VectorXd change = next - solution.unknowns;
    solution.unknowns = next;
    // Measured against what the data leave open.
    const double moved = std::sqrt(std::max(0.0, change.dot(solution.total.information * change)));
    const double size = std::sqrt(std::max(0.0, next.dot(solution.total.information * next)));
    if (adjust && moved <= kConverged * size + 1e-6) break;
  }
  solution.covariance = factor(solution.total.information).solve(Eigen::MatrixXd::Identity(n, n));
  return solution;
}

std::vector<std::vector<Prediction>> hold_out(const Problem& problem, const Solution& solution) {
  std::vector<std::vector<Prediction>> out(problem.blocks.size());
  for (std::size_t b = 0; b < problem.blocks.size(); ++b) {
    const Rest rest = without(problem, solution, b);
    for (const std::size_t i : problem.blocks[b].members) {
      const Row& row = problem.rows[i];
      out[b].push_back({i, residual(problem, row, rest.unknowns),
                        effective_covariance(problem, row, rest.unknowns) +
                            prediction_covariance(problem, linearised(problem, row, rest.unknowns),
                                                  rest.covariance)});
    }
  }
  return out;
}

std::vector<Vector6> hold_out_errors(const Problem& problem, const Solution& solution) {
  std::vector<Vector6> out(problem.rows.size());
  for (std::size_t b = 0; b < problem.blocks.size(); ++b) {
    const Rest rest = without(problem, solution, b);
    for (const std::size_t i : problem.blocks[b].members)
      out[i] = residual(problem, problem.rows[i], rest.unknowns);
  }
  return out;
}

}  // namespace tagwrench::fit
