#include "host/wrench/fit_select.h"

#include <Eigen/Cholesky>
#include <cmath>
#include <limits>

#include "host/wrench/fit_axes.h"

namespace tagwrench::fit {
namespace {

// A model is adopted when what it wins is this many standard errors, and worth having. Two rather
// than one, as the best of a dozen candidates is looked for.
constexpr double kSure = 2;
constexpr double kWorthwhile = 0.05;  // of the held-out squared residual
constexpr double kFelt = 0.001;       // of full load, held-out RMS of the axis that wins most

std::vector<FeatureSpec> candidates(const Problem& problem, const Judged& linear,
                                    std::span<const PathPoint> path) {
  std::vector<FeatureSpec> out;
  // How a load bends what no load has moved cannot be told.
  if (missing_loads(problem, linear.weighting.block).empty())
    out.push_back({.kind = FeatureKind::quadratic});
  if (path.size() < 2) return out;
  const double length = path.back().time - path.front().time;
  for (double tau = 1; tau <= 512 && tau <= length / 2; tau *= 2)
    out.push_back({.kind = FeatureKind::creep, .time_constant = tau});
  for (const double width : {0.02, 0.05, 0.1, 0.2})
    out.push_back({.kind = FeatureKind::hysteresis, .play = width * problem.motion_scale / 2});
  return out;
}

/// Mean over each block that counts, weighed as the linear model's residuals are.
std::vector<double> block_scores(const Problem& problem, const Judged& linear,
                                 const std::vector<Vector6>& errors) {
  std::vector<double> out;
  for (std::size_t b = 0; b < linear.held_out.size(); ++b) {
    if (linear.weighting.block[b] == 0) continue;
    double sum = 0;
    for (const Prediction& p : linear.held_out[b]) {
      Matrix6 S = p.covariance;
      S.diagonal() += linear.weighting.error.variance(problem.rows[p.row].load);
      sum += errors[p.row].dot(S.llt().solve(errors[p.row]));
    }
    out.push_back(sum / static_cast<double>(linear.held_out[b].size()));
  }
  return out;
}

/// RMS of what is held out and counts, of full load.
Vector6 held_out_rms(const Problem& problem, const Judged& linear,
                     const std::vector<Vector6>& errors) {
  Vector6 squares = Vector6::Zero();
  double n = 0;
  for (std::size_t i = 0; i < errors.size(); ++i) {
    if (linear.weighting.block[static_cast<std::size_t>(problem.rows[i].block)] == 0) continue;
    squares += errors[i].cwiseQuotient(problem.scale).cwiseAbs2();
    n += 1;
  }
  return (squares / n).cwiseSqrt();
}

}  // namespace

std::vector<ModelTrial> try_richer(const Problem& problem, const Judged& linear,
                                   std::span<const Observation> observations,
                                   std::span<const PathPoint> path) {
  const std::vector<Vector6> linear_errors = hold_out_errors(problem, linear.solution);
  const std::vector<double> reference = block_scores(problem, linear, linear_errors);
  const auto blocks = static_cast<double>(reference.size());
  double total = 0;
  for (const double score : reference) total += score;
  std::vector<ModelTrial> out;
  if (blocks < 3 || total == 0) return out;
  std::size_t best = 0;
  bool felt = false;
  double best_score = std::numeric_limits<double>::infinity();
  for (const FeatureSpec& features : candidates(problem, linear, path)) {
    const Problem other = with_features(problem, observations, path, features);
    const Solution solution = solve(other, linear.weighting, {});
    const std::vector<Vector6> errors = hold_out_errors(other, solution);
    const std::vector<double> scores = block_scores(problem, linear, errors);
    double sum = 0;
    for (const double score : scores) sum += score;
    const double mean_won = (total - sum) / blocks;
    double scatter = 0;
    for (std::size_t b = 0; b < scores.size(); ++b)
      scatter += std::pow(reference[b] - scores[b] - mean_won, 2);
    ModelTrial trial{.features = features,
                     .score = sum / total,
                     .score_sigma = std::sqrt(scatter / (blocks - 1) * blocks) / total};
    if (trial.score < best_score) {
      best_score = trial.score;
      best = out.size();
      felt = (held_out_rms(problem, linear, linear_errors) - held_out_rms(problem, linear, errors))
                 .maxCoeff() > kFelt;
    }
    out.push_back(trial);
  }
  if (out.empty()) return out;
  ModelTrial& winner = out[best];
  winner.adopted = felt && 1 - winner.score > std::max(kSure * winner.score_sigma, kWorthwhile);
  return out;
}

}  // namespace tagwrench::fit
