#include "host/wrench/fit_problem.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

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
    throw ConfigError(
        fmt::format("calibration: observation {} (step {}, {:.3f} s) has {}; redo that step",
                    index + 1, o.step + 1, o.time, what));
  };
  if (!std::isfinite(o.time) || !o.displacement.allFinite() || !o.wrench.allFinite())
    refuse("a number that is not finite");
  if (!is_covariance(o.displacement_covariance))
    refuse("a displacement_covariance that is no covariance");
  if (!is_covariance(o.wrench_covariance)) refuse("a wrench_covariance that is no covariance");
  for (const CorrelatedError& error : o.common) {
    if (!error.effect.allFinite()) refuse("a common error that is not finite");
  }
  for (const CorrelatedProduct& product : o.products) {
    if (!product.effect.allFinite() || std::max(product.first, product.second) >= o.common.size())
      refuse("a product of common errors that is none");
  }
}

/// Observations of a step in order of time, long ones cut into parts.
std::vector<Block> make_blocks(std::span<const Observation> observations) {
  std::map<int, std::vector<std::size_t>> steps;
  for (std::size_t i = 0; i < observations.size(); ++i) steps[observations[i].step].push_back(i);
  std::vector<Block> blocks;
  for (auto& [step, members] : steps) {
    std::stable_sort(members.begin(), members.end(), [&](std::size_t a, std::size_t b) {
      return observations[a].time < observations[b].time;
    });
    const bool is_long = members.size() >= kLongStep;
    const std::size_t parts = is_long ? kParts : 1;
    for (std::size_t part = 0; part < parts; ++part) {
      const std::size_t begin = members.size() * part / parts;
      const std::size_t end = members.size() * (part + 1) / parts;
      Block block{.step = step,
                  .from = observations[members[begin]].time,
                  .to = observations[members[end - 1]].time,
                  .members = {members.begin() + static_cast<std::ptrdiff_t>(begin),
                              members.begin() + static_cast<std::ptrdiff_t>(end)},
                  .is_long = is_long};
      blocks.push_back(std::move(block));
    }
  }
  return blocks;
}

template <typename Key>
int index_of(std::vector<Key>& known, const Key& key) {
  const auto found = std::find(known.begin(), known.end(), key);
  if (found != known.end()) return static_cast<int>(found - known.begin());
  known.push_back(key);
  return static_cast<int>(known.size()) - 1;
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
  for (std::size_t i = 0; i < order.size(); ++i) order[i] = i;
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return observations[a].time < observations[b].time;
  });
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
  for (std::size_t b = 0; b < problem.blocks.size(); ++b) {
    for (const std::size_t i : problem.blocks[b].members)
      problem.rows[i].block = static_cast<int>(b);
  }
  set_scales(problem);
  set_features(problem, observations, path);
  set_prior(problem, prior, prior_width);
  const std::size_t unknowns = 6 + problem.zeros.size();  // for each of the six axes
  if (!prior && observations.size() < unknowns) {
    throw ConfigError(fmt::format(
        "calibration: {} observations for {} unknowns an axis; take more steps, or give springs in "
        "sensor.yaml to complete it",
        observations.size(), unknowns));
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

}  // namespace tagwrench::fit
