#include "host/wrench/fit_solve.h"

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>

#include "host/core/algebra/decompositions.h"
#include "host/core/config_error.h"

namespace tagwrench::fit {
namespace {

constexpr std::size_t kLongStep = 20;  // observations
constexpr std::size_t kParts = 5;      // of a long step
// Where the springs' description is missing: so many times what the data suggest.
constexpr double kVague = 10;
// A richer model's further terms: what each may add at the largest displacement, of full load.
constexpr double kFurtherTerms = 0.1;
// The products of common errors are themselves common to several observations, whose weights must
// not add up as if they were not.
constexpr double kProductsShared = 4;
// Torque over force where all loads go through the origin, m: a hand's breadth is too much, a
// hair's too little.
constexpr double kLever = 0.02;

bool is_covariance(const Matrix6& c) {
  if (!c.allFinite()) return false;
  const double size = c.diagonal().cwiseAbs().maxCoeff();
  if (size == 0) return c.isZero(0);
  // In units in which the diagonal is one, as forces and torques differ by orders of magnitude.
  const Vector6 unit = c.diagonal().cwiseMax(1e-30 * size).cwiseSqrt().cwiseInverse();
  const Matrix6 scaled = unit.asDiagonal() * c * unit.asDiagonal();
  if (!(scaled - scaled.transpose()).isZero(1e-6)) return false;
  return symmetric_eigen(scaled).values[0] > -1e-6;
}

void check(const Observation& o, std::size_t index) {
  const auto refuse = [&](const char* what) {
    throw ConfigError("calibration: observation {} (step {}, {:.3f} s) has {}; redo that step",
                      index + 1, o.step + 1, o.time, what);
  };
  if (!std::isfinite(o.time) || !o.displacement.allFinite() || !o.wrench.allFinite())
    refuse("a number that is not finite");
  if (!is_covariance(o.displacement_covariance))
    refuse("a displacement_covariance that is no covariance");
  if (!is_covariance(o.wrench_covariance)) refuse("a wrench_covariance that is no covariance");
  for (const CorrelatedError& error : o.common)
    if (!error.effect.allFinite()) refuse("a common error that is not finite");
  for (const CorrelatedProduct& product : o.products)
    if (!product.effect.allFinite() || std::max(product.first, product.second) >= o.common.size())
      refuse("a product of common errors that is none");
}

/// Observations of a step in order of time, long ones cut into parts.
std::vector<Block> make_blocks(std::span<const Observation> observations) {
  std::map<int, std::vector<std::size_t>> steps;
  for (std::size_t i = 0; i < observations.size(); ++i) steps[observations[i].step].push_back(i);
  std::vector<Block> blocks;
  for (auto& [step, members] : steps) {
    std::ranges::stable_sort(members, {}, [&](std::size_t i) { return observations[i].time; });
    const bool is_long = members.size() >= kLongStep;
    const std::size_t parts = is_long ? kParts : 1;
    for (std::size_t part = 0; part < parts; ++part) {
      const std::size_t begin = members.size() * part / parts;
      const std::size_t end = members.size() * (part + 1) / parts;
      blocks.push_back({.step = step,
                        .from = observations[members[begin]].time,
                        .to = observations[members[end - 1]].time,
                        .members = {members.begin() + static_cast<std::ptrdiff_t>(begin),
                                    members.begin() + static_cast<std::ptrdiff_t>(end)},
                        .is_long = is_long});
    }
  }
  return blocks;
}

template <typename Key>
int index_of(std::vector<Key>& known, const Key& key) {
  const auto found = std::find(known.begin(), known.end(), key);
  const auto index = static_cast<int>(found - known.begin());
  if (found == known.end()) known.push_back(key);
  return index;
}

void set_scales(Problem& problem) {
  double force = 0, torque = 0;
  Vector6 low = problem.rows[0].displacement, high = low;
  for (const Row& row : problem.rows) {
    force = std::max(force, row.wrench.head<3>().norm());
    torque = std::max(torque, row.wrench.tail<3>().norm());
    low = low.cwiseMin(row.displacement);
    high = high.cwiseMax(row.displacement);
  }
  if (force == 0 && torque == 0)
    throw ConfigError("calibration: no observation carries a load; hang a mass or push, then fit");
  if (torque < 1e-3 * kLever * force) torque = kLever * force;
  if (force < 1e-3 * torque / kLever) force = torque / kLever;
  problem.scale << force, force, force, torque, torque, torque;
  problem.motion_scale = (high - low).cwiseMax(1e-9);
  for (Row& row : problem.rows) {
    row.load = row.wrench.cwiseQuotient(problem.scale).squaredNorm();
    if (!row.products.empty()) continue;
    double relative = 0;
    for (const auto& [index, effect] : row.common) {
      relative += effect.cwiseQuotient(problem.scale).squaredNorm() / std::max(row.load, 1e-6);
      row.second_order += effect.cwiseAbs2();
    }
    row.second_order *= kProductsShared * relative;
  }
}

/// Features at the observations' times, the memory carried along the path.
void set_features(Problem& problem, std::span<const Observation> observations,
                  std::span<const PathPoint> path) {
  std::vector<std::size_t> order(observations.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::ranges::stable_sort(order, {}, [&](std::size_t i) { return observations[i].time; });
  Features along(problem.features);
  std::size_t next = 0;
  double last = path.empty() ? 0.0 : path[0].time;
  for (const std::size_t i : order) {
    for (; next < path.size() && path[next].time <= observations[i].time; ++next) {
      along.update(path[next].displacement, path[next].time - last);
      last = path[next].time;
    }
    Features here = along;
    here.update(observations[i].displacement, std::max(0.0, observations[i].time - last));
    problem.rows[i].phi = here.values();
    problem.rows[i].jacobian = here.jacobian();
  }
}

void set_prior(Problem& problem, const std::optional<Matrix6>& prior, double width) {
  const int count = feature_count(problem.features.kind);
  problem.has_prior = prior.has_value();
  problem.prior_mean = Eigen::MatrixXd::Zero(6, count);
  problem.prior_sigma = Eigen::MatrixXd::Zero(6, count);
  if (prior) {
    problem.prior_mean.leftCols<6>() = *prior;
    problem.prior_sigma.leftCols<6>() = prior_sigma_of(*prior, width);
  } else {
    problem.prior_sigma.leftCols<6>() =
        kVague * problem.scale * problem.motion_scale.cwiseInverse().transpose();
  }
  for (int k = 6; k < count; ++k) {
    double largest = 0;
    for (const Row& row : problem.rows) largest = std::max(largest, std::abs(row.phi[k]));
    if (largest > 0) problem.prior_sigma.col(k) = kFurtherTerms / largest * problem.scale;
  }
  // A term that never varied stays at zero, whatever it is.
  problem.prior_sigma = problem.prior_sigma.cwiseMax(1e-12 * problem.prior_sigma.maxCoeff());
}

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
    for (const auto& [other, its_effect] : row.common)
      if (other <= index) to.information(c, problem.common_at(other)) += We.dot(its_effect);
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

Matrix6 prior_sigma_of(const Matrix6& stiffness, double width) {
  const Vector6 root = stiffness.diagonal().cwiseAbs().cwiseSqrt();
  return width * root * root.transpose();
}

Problem make_problem(std::span<const Observation> observations, std::span<const PathPoint> path,
                     const FeatureSpec& features, const std::optional<Matrix6>& prior,
                     double prior_width) {
  if (observations.empty())
    throw ConfigError("calibration: no step has been taken; take those of the plan, then fit");
  for (std::size_t i = 0; i < observations.size(); ++i) check(observations[i], i);
  if (prior &&
      (!prior->allFinite() || (prior->diagonal().array() <= 0).any() || !(prior_width > 0)))
    throw ConfigError(
        "calibration: the spring model has a stiffness that is not positive; correct springs in "
        "sensor.yaml");
  Problem problem;
  problem.features = features;
  problem.blocks = make_blocks(observations);
  problem.rows.resize(observations.size());
  for (std::size_t i = 0; i < observations.size(); ++i) {
    const Observation& o = observations[i];
    Row& row = problem.rows[i];
    row.displacement = o.displacement;
    row.wrench = o.wrench;
    row.displacement_covariance = o.displacement_covariance;
    row.wrench_covariance = o.wrench_covariance;
    row.zero = index_of(problem.zeros, o.zero);
    for (const CorrelatedError& error : o.common)
      row.common.emplace_back(index_of(problem.common_names, error.name), error.effect);
    for (const CorrelatedProduct& product : o.products) {
      row.products.push_back(
          {row.common[product.first].first, row.common[product.second].first, product.effect});
    }
  }
  for (std::size_t b = 0; b < problem.blocks.size(); ++b)
    for (const std::size_t i : problem.blocks[b].members)
      problem.rows[i].block = static_cast<int>(b);
  set_scales(problem);
  set_features(problem, observations, path);
  set_prior(problem, prior, prior_width);
  const std::size_t unknowns = 6 + problem.zeros.size();  // for each of the six axes
  if (!prior && observations.size() < unknowns) {
    throw ConfigError(
        "calibration: {} observations for {} unknowns an axis; take more steps, or give springs in "
        "sensor.yaml to complete it",
        observations.size(), unknowns);
  }
  return problem;
}

Problem with_features(const Problem& problem, std::span<const Observation> observations,
                      std::span<const PathPoint> path, const FeatureSpec& features) {
  Problem other = problem;
  other.features = features;
  set_features(other, observations, path);
  const Eigen::MatrixXd mean = problem.prior_mean, sigma = problem.prior_sigma;
  set_prior(other, std::nullopt, 0);
  other.has_prior = problem.has_prior;
  other.prior_mean.leftCols<6>() = mean.leftCols<6>();
  other.prior_sigma.leftCols<6>() = sigma.leftCols<6>();
  return other;
}

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

Weighting equal_weights(const Problem& problem, const ErrorModel& error) {
  return {.error = error, .block = std::vector<double>(problem.blocks.size(), 1.0)};
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
      // The displacement as adjusted, and the wrench to go with it. The model's error
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
