#include "host/wrench/fit_axes.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <Eigen/SVD>
#include <algorithm>
#include <cmath>

#include "host/core/algebra/decompositions.h"
#include "host/core/axis_names.h"

namespace tagwrench::fit {
namespace {

constexpr double kReachedRatio = 0.25;  // standard deviation after over before
constexpr double kReachedError = 0.10;  // of full load, in all six numbers together
constexpr double kMissing = 0.02;       // singular value over the largest
constexpr double kTakesFraction = 0.3;  // in a combination

/// Sum over the six answers to a motion d of their variances, in natural scales, is d^T A d.
Matrix6 answer_variance(const Problem& problem, const Eigen::MatrixXd& covariance) {
  Matrix6 A = Matrix6::Zero();
  for (int k = 0; k < 6; ++k) {
    for (int l = 0; l < 6; ++l) {
      for (int i = 0; i < 6; ++i)
        A(k, l) += covariance(6 * k + i, 6 * l + i) / (problem.scale[i] * problem.scale[i]);
    }
  }
  return A;
}

}  // namespace

std::array<AxisKnowledge, 6> axis_knowledge(const Problem& problem, const Matrix6& K,
                                            const Eigen::MatrixXd& covariance) {
  // The motion that answers a load best: what it misses of the load, and what is not known of its
  // answer, are least together. (K^-1 would also use motions that no load has ever made.)
  const Vector6 per_scale = problem.scale.cwiseAbs2().cwiseInverse();
  const Matrix6 A = answer_variance(problem, covariance);
  const Matrix6 weighed = K.transpose() * per_scale.asDiagonal();
  const Matrix6 unit = problem.motion_scale.asDiagonal();
  const Ldlt<6> least(unit * (weighed * K + A) * unit + 1e-12 * Matrix6::Identity());
  std::array<AxisKnowledge, 6> out;
  for (int axis = 0; axis < 6; ++axis) {
    const Vector6 load = problem.scale[axis] * Vector6::Unit(axis);
    const Vector6 motion = unit * least.solve(unit * (weighed * load));
    const double missed = (K * motion - load).cwiseQuotient(problem.scale).squaredNorm();
    const double after = motion.dot(A * motion);
    const double before =
        per_scale.dot(problem.prior_sigma.leftCols<6>().cwiseAbs2() * motion.cwiseAbs2());
    const double error = std::sqrt(missed + after);
    const double ratio = before > 0 ? std::min(1.0, std::sqrt(after / before)) : 1;
    double own = 0;
    for (int k = 0; k < 6; ++k) {
      for (int l = 0; l < 6; ++l)
        own += motion[k] * motion[l] * covariance(6 * k + axis, 6 * l + axis);
    }
    out[static_cast<std::size_t>(axis)] = {
        .reached = error <= kReachedError && (ratio <= kReachedRatio || !problem.has_prior),
        .coverage = missed > kReachedError ? 0 : 1 - ratio,
        .gain_sigma = std::sqrt(missed + std::max(0.0, own) * per_scale[axis])};
  }
  return out;
}

std::vector<Vector6> missing_loads(const Problem& problem, const std::vector<double>& weight) {
  Matrix6 moment = Matrix6::Zero();
  for (const Row& row : problem.rows) {
    if (weight[static_cast<std::size_t>(row.block)] == 0) continue;
    const Vector6 load = row.wrench.cwiseQuotient(problem.scale);
    moment += load * load.transpose();
  }
  const Eigen::JacobiSVD<Matrix6> svd(moment, Eigen::ComputeFullV);
  std::vector<Vector6> out;
  for (int i = 0; i < 6; ++i) {
    if (svd.singularValues()[i] < kMissing * kMissing * svd.singularValues()[0])
      out.push_back(svd.matrixV().col(i));
  }
  return out;
}

std::string missing_name(const Vector6& combination) {
  std::vector<std::string> names;
  for (int i = 0; i < 6; ++i) {
    if (std::abs(combination[i]) > kTakesFraction)
      names.emplace_back(kWrenchAxes[static_cast<std::size_t>(i)]);
  }
  return names.size() == 1 ? names[0]
                           : fmt::format("{} apart from each other", fmt::join(names, " and "));
}

std::string missing_reason(int axis, const std::vector<Vector6>& missing, double gain_sigma) {
  double part = 0;
  const Vector6* where = nullptr;
  double alone = 0;  // squared share of the axis in all that is missing
  for (const Vector6& combination : missing) {
    alone += combination[axis] * combination[axis];
    if (std::abs(combination[axis]) > part) {
      part = std::abs(combination[axis]);
      where = &combination;
    }
  }
  const char* names = "xyz";
  if (alone > 0.9) {
    return axis < 3 ? fmt::format("no force along {} was applied", names[axis])
                    : fmt::format("no torque about {} was applied", names[axis - 3]);
  }
  if (where != nullptr && part > kTakesFraction) {
    std::vector<std::string> others;
    for (int i = 0; i < 6; ++i) {
      if (std::abs((*where)[i]) > kTakesFraction)
        others.emplace_back(kWrenchAxes[static_cast<std::size_t>(i)]);
    }
    return fmt::format("{} were only applied together", fmt::join(others, " and "));
  }
  return gain_sigma > 0 ? fmt::format(
                              "the loads along it were too few, too small or too uncertain "
                              "to tell it better than to {:.0f} %",
                              std::max(1.0, 100 * gain_sigma))
                        : "the platform did not yield to the loads along it";
}

}  // namespace tagwrench::fit
