#include "host/wrench/fit_axes.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <Eigen/SVD>
#include <cmath>

namespace tagwrench::fit {
namespace {

constexpr std::array<const char*, 6> kAxis{"Fx", "Fy", "Fz", "Mx", "My", "Mz"};
constexpr double kReachedRatio = 0.25;  // standard deviation after over before
constexpr double kReachedError = 0.10;  // of full load, in all six numbers together
constexpr double kMissing = 0.02;       // singular value over the largest
constexpr double kTakesPart = 0.3;      // in a combination

/// Motion that a load of one natural scale along each axis makes; columns of directions that the
/// stiffness does not resist are zero.
Matrix6 motions(const Problem& problem, const Matrix6& K, Vector6& resolved) {
  const Matrix6 scaled =
      problem.scale.cwiseInverse().asDiagonal() * K * problem.motion_scale.asDiagonal();
  Eigen::JacobiSVD<Matrix6> svd(scaled, Eigen::ComputeFullU | Eigen::ComputeFullV);
  svd.setThreshold(1e-3);
  const Matrix6 inverse = svd.solve(Matrix6::Identity());
  const Matrix6 missed = Matrix6::Identity() - scaled * inverse;
  resolved = missed.colwise().norm().transpose();
  return problem.motion_scale.asDiagonal() * inverse;
}

/// Variances of the six answers to one motion.
Vector6 answer_variance(const Vector6& motion, const Eigen::MatrixXd& covariance) {
  Matrix6 sum = Matrix6::Zero();
  for (int k = 0; k < 6; ++k) {
    for (int l = 0; l < 6; ++l) sum += motion[k] * motion[l] * covariance.block<6, 6>(6 * k, 6 * l);
  }
  return sum.diagonal().cwiseMax(0);
}

}  // namespace

std::array<AxisKnowledge, 6> axis_knowledge(const Problem& problem, const Matrix6& K,
                                            const Eigen::MatrixXd& covariance) {
  Vector6 unresolved;
  const Matrix6 motion = motions(problem, K, unresolved);
  const Vector6 per_scale = problem.scale.cwiseAbs2().cwiseInverse();
  std::array<AxisKnowledge, 6> out;
  for (int axis = 0; axis < 6; ++axis) {
    if (unresolved[axis] > 0.1) continue;
    const Vector6 after = answer_variance(motion.col(axis), covariance);
    const Vector6 before =
        problem.prior_sigma.leftCols<6>().cwiseAbs2() * motion.col(axis).cwiseAbs2();
    const double error = std::sqrt(after.dot(per_scale));
    const double ratio = error / std::sqrt(before.dot(per_scale));
    out[static_cast<std::size_t>(axis)] = {
        .reached = error <= kReachedError && (ratio <= kReachedRatio || !problem.has_prior),
        .coverage = std::clamp(1 - ratio, 0.0, 1.0),
        .gain_sigma = std::sqrt(after[axis]) / problem.scale[axis]};
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
    if (std::abs(combination[i]) > kTakesPart)
      names.emplace_back(kAxis[static_cast<std::size_t>(i)]);
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
  if (where != nullptr && part > kTakesPart) {
    std::vector<std::string> others;
    for (int i = 0; i < 6; ++i) {
      if (std::abs((*where)[i]) > kTakesPart)
        others.emplace_back(kAxis[static_cast<std::size_t>(i)]);
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
