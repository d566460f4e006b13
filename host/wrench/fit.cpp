#include "host/wrench/fit.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <Eigen/Geometry>
#include <Eigen/SVD>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>

#include "host/core/algebra/decompositions.h"
#include "host/core/axis_names.h"
#include "host/core/config_error.h"
#include "host/wrench/fit_solve.h"

namespace tagwrench {
namespace {

Vector6 wrench_at(const Eigen::Vector3d& point, const Eigen::Vector3d& force) {
  Vector6 w;
  w << force, point.cross(force);
  return w;
}

using namespace fit;

// Which of the six axes a fit knows, and why not the others.

constexpr double kReachedRatio = 0.25;  // standard deviation after over before
constexpr double kReachedError = 0.10;  // of full load, in all six numbers together
constexpr double kMissing = 0.02;       // singular value over the largest
constexpr double kTakesFraction = 0.3;  // in a combination

struct AxisKnowledge {
  bool reached = false;   ///< the answer to a load along this axis is known
  double coverage = 0;    ///< 1 - standard deviation after over before
  double gain_sigma = 0;  ///< relative
};

/// Sum over the six answers to a motion d of their variances, in natural scales, is d^T A d.
Matrix6 answer_variance(const Problem& problem, const Eigen::MatrixXd& covariance) {
  Matrix6 A = Matrix6::Zero();
  for (int k = 0; k < 6; ++k) {
    for (int l = 0; l < 6; ++l)
      for (int i = 0; i < 6; ++i)
        A(k, l) += covariance(6 * k + i, 6 * l + i) / (problem.scale[i] * problem.scale[i]);
  }
  return A;
}

/// How well the answers to loads along each axis are known. `K`: the fitted stiffness;
/// `covariance`: of all unknowns.
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
    for (int k = 0; k < 6; ++k)
      for (int l = 0; l < 6; ++l)
        own += motion[k] * motion[l] * covariance(6 * k + axis, 6 * l + axis);
    out[static_cast<std::size_t>(axis)] = {
        .reached = error <= kReachedError && (ratio <= kReachedRatio || !problem.has_prior),
        .coverage = missed > kReachedError ? 0 : 1 - ratio,
        .gain_sigma = std::sqrt(missed + std::max(0.0, own) * per_scale[axis])};
  }
  return out;
}

/// Combinations of axes along which no load acted, each a unit vector in natural scales. `weight`:
/// of blocks.
std::vector<Vector6> missing_loads(const Problem& problem, const std::vector<double>& weight) {
  Matrix6 moment = Matrix6::Zero();
  for (const Row& row : problem.rows) {
    if (weight[static_cast<std::size_t>(row.block)] == 0) continue;
    const Vector6 load = row.wrench.cwiseQuotient(problem.scale);
    moment += load * load.transpose();
  }
  const Eigen::JacobiSVD<Matrix6> svd(moment, Eigen::ComputeFullV);
  std::vector<Vector6> out;
  for (int i = 0; i < 6; ++i)
    if (svd.singularValues()[i] < kMissing * kMissing * svd.singularValues()[0])
      out.push_back(svd.matrixV().col(i));
  return out;
}

/// "Fx and My": the axes that take part in a combination.
std::string axes_of(const Vector6& combination) {
  std::vector<std::string> names;
  for (int i = 0; i < 6; ++i)
    if (std::abs(combination[i]) > kTakesFraction) names.emplace_back(wrench_axis(i));
  return fmt::format("{}", fmt::join(names, " and "));
}

/// "Mz"; "Fx and My apart from each other".
std::string missing_name(const Vector6& combination) {
  const bool one = (combination.array().abs() > kTakesFraction).count() == 1;
  return axes_of(combination) + (one ? "" : " apart from each other");
}

/// "no torque about z was applied".
std::string missing_reason(int axis, const std::vector<Vector6>& missing, double gain_sigma) {
  double alone = 0;  // squared share of the axis in all that is missing
  Vector6 most = Vector6::Zero();
  for (const Vector6& combination : missing) {
    alone += combination[axis] * combination[axis];
    if (std::abs(combination[axis]) > std::abs(most[axis])) most = combination;
  }
  if (alone > 0.9) {
    return fmt::format("no {} {} was applied", axis < 3 ? "force along" : "torque about",
                       "xyz"[axis % 3]);
  }
  if (std::abs(most[axis]) > kTakesFraction) return axes_of(most) + " were only applied together";
  if (!(gain_sigma > 0)) return "the platform did not yield to the loads along it";
  return fmt::format(
      "the loads along it were too few, too small or too uncertain to tell it better than to "
      "{:.0f} %",
      std::max(1.0, 100 * gain_sigma));
}

// Models richer than the linear one, and whether held-out data want them.

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
    for (const Prediction& p : linear.held_out[b])
      sum += chi2_of(problem, p, linear.weighting.error, errors[p.row]);
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

/// All that were tried against `linear`; at most one is adopted.
std::vector<ModelTrial> try_richer(const Problem& problem, const Judged& linear,
                                   std::span<const Observation> observations,
                                   std::span<const PathPoint> path) {
  const std::vector<Vector6> linear_errors = hold_out_errors(problem, linear.solution);
  const std::vector<double> reference = block_scores(problem, linear, linear_errors);
  const auto blocks = static_cast<double>(reference.size());
  const double total = std::accumulate(reference.begin(), reference.end(), 0.0);
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
    const double sum = std::accumulate(scores.begin(), scores.end(), 0.0);
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

// What people are told of a fit.

constexpr double kUnloaded = 0.5;  // share of an axis in the loads that are missing
constexpr double kInside95 = 1.96;
constexpr double kGrossError = 0.2;    // of full load: the model's own
constexpr double kFalseAlarms = 1e-3;  // healthy calibrations in which some common error is told of

/// Assumes reciprocity, in the units of the springs' stiffness or, without springs, of the one that
/// the data give by themselves.
void assume_reciprocity(Problem& problem, const FitOptions& options) {
  if (!(options.reciprocity > 0)) return;
  Matrix6 stiffness;
  if (options.prior) {
    stiffness = *options.prior;
  } else {
    stiffness = solve(problem, equal_weights(problem, {}), {}).stiffness();
    if ((stiffness.diagonal().array() <= 0).any()) return;
  }
  problem.reciprocity = prior_sigma_of(stiffness, options.reciprocity);
}

/// Of the offset that the sensor will be used with.
int zero_in_use(const Problem& problem, std::span<const Observation> observations,
                const FitOptions& options) {
  const int zero = options.zero_in_use.value_or(observations.front().zero);
  const auto found = std::find(problem.zeros.begin(), problem.zeros.end(), zero);
  if (found == problem.zeros.end()) {
    throw ConfigError(
        "calibration: no step was taken in mounting {}, in which the sensor is to be used; take "
        "one at rest there",
        zero + 1);
  }
  return static_cast<int>(found - problem.zeros.begin());
}

WrenchModel model_of(const Problem& problem, const Judged& judged, int zero) {
  WrenchModel model;
  const int columns = problem.feature_columns();
  const Eigen::VectorXd& x = judged.solution.unknowns;
  const Eigen::MatrixXd& C = judged.solution.covariance;
  const int offset = problem.zero_at(zero);
  model.K = judged.solution.stiffness();
  model.features = problem.features;
  model.extra = Eigen::Map<const Eigen::MatrixXd>(x.data() + 36, 6, columns - 6);
  model.B = x.segment<6>(offset);
  const int n = 6 * columns;
  model.parameter_covariance.resize(n + 6, n + 6);
  model.parameter_covariance << C.topLeftCorner(n, n), C.block(0, offset, n, 6),
      C.block(offset, 0, 6, n), C.block(offset, offset, 6, 6);
  model.model_covariance = judged.weighting.error.constant.cwiseAbs2().asDiagonal();
  model.error_at_full_load = judged.weighting.error.proportional;
  model.full_load = problem.scale;
  return model;
}

void set_held_out(const Problem& problem, const Judged& judged, WrenchFit& out) {
  Vector6 squares = Vector6::Zero(), sum = Vector6::Zero(), spread = Vector6::Zero(),
          inside = Vector6::Zero();
  double n = 0;
  for (std::size_t b = 0; b < judged.held_out.size(); ++b) {
    if (judged.weighting.block[b] == 0) continue;
    for (const Prediction& p : judged.held_out[b]) {
      const Row& row = problem.rows[p.row];
      const Vector6 variance = p.covariance.diagonal() + judged.weighting.error.variance(row.load);
      out.held_out.push_back({p.row, row.wrench - p.error, variance.cwiseSqrt()});
      squares += p.error.cwiseAbs2();
      inside += (p.error.cwiseAbs().array() <= kInside95 * variance.array().sqrt())
                    .cast<double>()
                    .matrix();
      sum += row.wrench;
      spread += row.wrench.cwiseAbs2();
      n += 1;
    }
  }
  if (n == 0) return;
  spread -= sum.cwiseAbs2() / n;
  for (int i = 0; i < 6; ++i) {
    AxisFit& axis = out.axis[static_cast<std::size_t>(i)];
    axis.held_out_rmse = std::sqrt(squares[i] / n);
    const double noise = 1e-6 * problem.scale[i];
    axis.held_out_r2 = spread[i] > n * noise * noise ? 1 - squares[i] / spread[i] : 0;
    out.inside_95[static_cast<std::size_t>(i)] = inside[i] / n;
  }
}

/// Load shown over load applied: of forces, as torques also tell where they act; of torques where
/// there is no force.
double load_ratio(const Problem& problem, const std::vector<Prediction>& block) {
  Vector6 shown = Vector6::Zero(), applied = Vector6::Zero();
  for (const Prediction& p : block) {
    const Vector6 wrench = problem.rows[p.row].wrench.cwiseQuotient(problem.scale);
    const Vector6 error = p.error.cwiseQuotient(problem.scale);
    shown += wrench.cwiseProduct(wrench - error);
    applied += wrench.cwiseAbs2();
  }
  const double least = 1e-6 * static_cast<double>(block.size());
  if (applied.head<3>().sum() > least) return shown.head<3>().sum() / applied.head<3>().sum();
  return applied.sum() > least ? shown.sum() / applied.sum() : 0;
}

std::string remark_on(const BlockFit& block) {
  const std::string which =
      block.observations > 1 && block.to > block.from
          ? fmt::format("step {} ({:.1f} to {:.1f} s)", block.step + 1, block.from, block.to)
          : fmt::format("step {}", block.step + 1);
  if (block.load_ratio == 0) {
    return which +
           ": the rest has moved against the other rests: was the sensor bumped, or a tag moved?";
  }
  const double off = 100 * (block.load_ratio - 1);
  if (std::abs(off) < 1) {
    return which +
           ": the load is as large as the others say, but acts elsewhere: another point, or the "
           "string rubs?";
  }
  return fmt::format("{}: shows {:.{}f} % {} than the others say: {}", which, std::abs(off),
                     std::abs(off) < 10 ? 1 : 0, off < 0 ? "less" : "more",
                     block.load_ratio < 0 ? "it pulls the other way"
                                          : "another mass, a slipped string, or a finger on it?");
}

void set_blocks(const Problem& problem, const Judged& judged, WrenchFit& out) {
  for (std::size_t b = 0; b < problem.blocks.size(); ++b) {
    const Block& block = problem.blocks[b];
    BlockFit fitted{.step = block.step,
                    .from = block.from,
                    .to = block.to,
                    .observations = static_cast<int>(block.members.size()),
                    .rejected = judged.weighting.block[b] == 0,
                    .deviation = std::sqrt(judged.chi2[b]),
                    .load_ratio = load_ratio(problem, judged.held_out[b])};
    if (fitted.rejected) {
      fitted.remark = remark_on(fitted);
      out.warnings.push_back("left out: " + fitted.remark);
    }
    out.blocks.push_back(std::move(fitted));
  }
  if (judged.too_many_outliers) {
    out.warnings.push_back(
        "more than a quarter of the steps contradict the others, so none was left out: check "
        "masses, points and directions of the plan");
  }
}

void set_axes(const Problem& problem, const Judged& judged, WrenchFit& out) {
  const auto missing = missing_loads(problem, judged.weighting.block);
  for (const Vector6& combination : missing) out.missing.push_back(missing_name(combination));
  const auto known = axis_knowledge(problem, out.model.K, judged.solution.covariance);
  for (std::size_t i = 0; i < 6; ++i) {
    AxisFit& axis = out.axis[i];
    const auto row = static_cast<int>(i);
    for (const Row& r : problem.rows)
      if (judged.weighting.block[static_cast<std::size_t>(r.block)] > 0)
        axis.largest = std::max(axis.largest, std::abs(r.wrench[row]));
    axis.coverage = known[i].coverage;
    axis.gain_sigma = known[i].gain_sigma;
    axis.error_constant = judged.weighting.error.constant[row];
    axis.error_proportional = judged.weighting.error.proportional[row];
    // A load that was never there does not make an axis known, however small the error that what
    // there was of it by chance would leave.
    double unloaded = 0;
    for (const Vector6& combination : missing) unloaded += combination[row] * combination[row];
    if (known[i].reached && unloaded < kUnloaded) {
      axis.state = AxisState::calibrated;
      out.model.range[row] = axis.largest;
    } else {
      axis.state = problem.has_prior ? AxisState::spring_model : AxisState::not_determined;
      axis.reason = missing_reason(row, missing, axis.gain_sigma);
    }
  }
}

void set_common(const Problem& problem, const Judged& judged, WrenchFit& out) {
  // Each of n is looked at, and a normal variable exceeds z with a probability below exp(-z^2 / 2)
  // (Chernoff), so that this z is exceeded by any (Bonferroni) in kFalseAlarms at the most.
  const auto n = static_cast<double>(problem.common_names.size());
  const double most = std::sqrt(2 * std::log(std::max(n, 1.0) / kFalseAlarms));
  for (std::size_t c = 0; c < problem.common_names.size(); ++c) {
    const int at = problem.common_at(static_cast<int>(c));
    CorrelatedEstimate common{.name = problem.common_names[c],
                              .value = judged.solution.unknowns[at],
                              .sigma = std::sqrt(judged.solution.covariance(at, at))};
    if (std::abs(common.value) > most) {
      out.warnings.push_back(
          fmt::format("{}: off by {:.1f} times its stated uncertainty, if the other steps are "
                      "right; measure it again",
                      common.name, std::abs(common.value)));
    }
    out.common.push_back(std::move(common));
  }
}

/// What is off by so much is no calibration, however honestly it says so. Where no axis is
/// calibrated, they say why themselves.
void refuse_gross_errors(const Problem& problem, const WrenchFit& fitted) {
  if (std::none_of(fitted.axis.begin(), fitted.axis.end(),
                   [](const AxisFit& axis) { return axis.state == AxisState::calibrated; }))
    return;
  for (std::size_t i = 0; i < 6; ++i) {
    const AxisFit& axis = fitted.axis[i];
    const double off = std::hypot(axis.error_constant, axis.error_proportional) /
                       problem.scale[static_cast<int>(i)];
    if (axis.largest == 0 || off < kGrossError) continue;
    throw ConfigError(
        "calibration: the steps contradict each other by {:.0f} % of full load in {}, whichever "
        "few are left out; check masses, points and directions of the plan, then take the steps "
        "again",
        100 * off, kWrenchAxes[i]);
  }
}

void require_all(const WrenchFit& fitted) {
  std::vector<std::string> lacking;
  for (std::size_t i = 0; i < 6; ++i) {
    if (fitted.axis[i].state != AxisState::calibrated)
      lacking.push_back(
          fmt::format("{} is not calibrated ({})", kWrenchAxes[i], fitted.axis[i].reason));
  }
  if (lacking.empty()) return;
  throw ConfigError("calibration: {}; add steps that load it, or let the spring model complete it",
                    fmt::join(lacking, ", "));
}

}  // namespace

void set_line_load(const LineLoad& load, Observation& observation) {
  const Eigen::Vector3d force = load.force * load.direction;
  const Eigen::Vector3d across = load.direction.unitOrthogonal();
  const Eigen::Vector3d other = load.direction.cross(across);
  observation.wrench = wrench_at(load.point, force);
  observation.wrench_covariance.setZero();
  observation.common.clear();
  observation.products.clear();
  const auto alone = [&](double sigma, const Vector6& unit) {
    observation.wrench_covariance += sigma * sigma * unit * unit.transpose();
  };
  constexpr std::size_t kNone = static_cast<std::size_t>(-1);
  const auto shared = [&](double sigma, const std::string& name, const Vector6& unit) {
    if (!(sigma > 0)) return kNone;
    observation.common.push_back({name, sigma * unit});
    return observation.common.size() - 1;
  };
  const auto product = [&](std::size_t a, std::size_t b, const Vector6& effect) {
    if (a != kNone && b != kNone) observation.products.push_back({a, b, effect});
  };
  const auto torque = [](const Eigen::Vector3d& arm, const Eigen::Vector3d& pull) {
    Vector6 w = Vector6::Zero();
    w.tail<3>() = arm.cross(pull);
    return w;
  };

  const Vector6 along = wrench_at(load.point, load.direction);
  const double stronger = load.force_sigma * load.force;
  const std::size_t gain = shared(stronger, load.force_name, along);
  alone(load.force_noise, along);

  const double aside = load.direction_sigma * load.force;
  const std::array<Eigen::Vector3d, 2> ways{across, other};
  std::array<std::size_t, 2> tilt{};
  for (std::size_t i = 0; i < 2; ++i) {
    const Vector6 unit = wrench_at(load.point, ways[i]);
    tilt[i] = shared(aside, load.direction_name + (i == 0 ? ", one way" : ", the other way"), unit);
    alone(load.direction_noise * load.force, unit);
    product(tilt[i], gain, load.force_sigma * aside * unit);
    product(tilt[i], tilt[i], -0.5 * load.direction_sigma * aside * along);
  }

  // Along the line the point may lie anywhere.
  for (std::size_t i = 0; i < 2; ++i) {
    shared(load.contact_sigma, load.contact_name + (i == 0 ? ", one way" : ", the other way"),
           torque(ways[i], force));
  }

  constexpr std::array<const char*, 3> kAxis{", x", ", y", ", z"};
  for (std::size_t k = 0; k < 3; ++k) {
    const Eigen::Vector3d axis = Eigen::Vector3d::Unit(static_cast<Eigen::Index>(k));
    const double off = load.point_sigma;
    const std::size_t moved = shared(off, load.point_name + kAxis[k], torque(axis, force));
    alone(load.point_noise, torque(axis, force));
    product(moved, gain, off * stronger * torque(axis, load.direction));
    for (std::size_t i = 0; i < 2; ++i)
      product(moved, tilt[i], off * aside * torque(axis, ways[i]));
  }
}

WrenchFit fit_wrench(std::span<const Observation> observations, std::span<const PathPoint> path,
                     const FitOptions& options) {
  Problem problem = make_problem(observations, path, {}, options.prior, options.prior_width);
  assume_reciprocity(problem, options);
  WrenchFit out;
  const Explanation explanation = explain(problem);
  Judged judged = judge_explained(problem, explanation, out.warnings);
  if (!explanation.found) {
    out.warnings.push_back(
        "the steps contradict each other, and no few of them explain it: the errors below are what "
        "they disagree by; check masses, points and directions of the plan");
  }
  if (options.try_richer) {
    out.trials = try_richer(problem, judged, observations, path);
    for (const ModelTrial& trial : out.trials) {
      if (!trial.adopted) continue;
      problem = with_features(problem, observations, path, trial.features);
      judged = judge(problem, explanation.left_out);
      break;
    }
  }
  out.model = model_of(problem, judged, zero_in_use(problem, observations, options));
  set_held_out(problem, judged, out);
  set_blocks(problem, judged, out);
  set_axes(problem, judged, out);
  set_common(problem, judged, out);
  refuse_gross_errors(problem, out);
  if (options.require_all) require_all(out);
  return out;
}

Vector6 coverage(std::span<const Observation> observations, const Matrix6& stiffness,
                 double prior_width) {
  if (std::none_of(observations.begin(), observations.end(),
                   [](const Observation& o) { return o.wrench.squaredNorm() > 0; }))
    return Vector6::Zero();
  const Problem problem = make_problem(observations, {}, {}, stiffness, prior_width);
  constexpr double kModelError = 0.005;  // of the load: no answer is better than a small one
  const Weighting weighting =
      equal_weights(problem, {Vector6::Zero(), kModelError * problem.scale});
  const auto known = axis_knowledge(problem, stiffness, solve(problem, weighting, {}).covariance);
  Vector6 out;
  for (int i = 0; i < 6; ++i) out[i] = known[static_cast<std::size_t>(i)].coverage;
  return out;
}

}  // namespace tagwrench
