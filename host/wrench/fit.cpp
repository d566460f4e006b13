#include "host/wrench/fit.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

#include "host/core/axis_names.h"
#include "host/core/config_error.h"
#include "host/wrench/fit_axes.h"
#include "host/wrench/fit_consistency.h"
#include "host/wrench/fit_errors.h"
#include "host/wrench/fit_select.h"

namespace tagwrench {
namespace {

using fit::Judged;
using fit::Problem;

constexpr double kUnloaded = 0.5;  // share of an axis in the loads that are missing
constexpr double kInside95 = 1.96;
constexpr double kGrossError = 0.2;    // of full load: the model's own
constexpr double kFalseAlarms = 1e-3;  // healthy calibrations in which some common error is told of

Matrix6 stiffness_of(const Eigen::VectorXd& unknowns) {
  return Eigen::Map<const Matrix6>(unknowns.data());
}

/// Assumes reciprocity, in the units of the springs' stiffness or, without springs, of the one that
/// the data give by themselves.
void assume_reciprocity(Problem& problem, const FitOptions& options) {
  if (!(options.reciprocity > 0)) return;
  Matrix6 stiffness;
  if (options.prior) {
    stiffness = *options.prior;
  } else {
    const fit::Weighting equal{.error = {},
                               .block = std::vector<double>(problem.blocks.size(), 1.0)};
    stiffness = stiffness_of(fit::solve(problem, equal, {}).unknowns);
    if ((stiffness.diagonal().array() <= 0).any()) return;
  }
  problem.reciprocity = fit::prior_sigma_of(stiffness, options.reciprocity);
}

/// Of the offset that the sensor will be used with.
int zero_in_use(const Problem& problem, std::span<const Observation> observations,
                const FitOptions& options) {
  const int zero = options.zero_in_use.value_or(observations.front().zero);
  const auto found = std::find(problem.zeros.begin(), problem.zeros.end(), zero);
  if (found == problem.zeros.end()) {
    throw ConfigError(fmt::format(
        "calibration: no step was taken in mounting {}, in which the sensor is to be used; take "
        "one at rest there",
        zero + 1));
  }
  return static_cast<int>(found - problem.zeros.begin());
}

WrenchModel model_of(const Problem& problem, const Judged& judged, int zero) {
  WrenchModel model;
  const int columns = problem.feature_columns();
  const Eigen::VectorXd& x = judged.solution.unknowns;
  const Eigen::MatrixXd& C = judged.solution.covariance;
  const int offset = problem.zero_at(zero);
  model.K = stiffness_of(x);
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
    for (const fit::Prediction& p : judged.held_out[b]) {
      const fit::Row& row = problem.rows[p.row];
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
double load_ratio(const Problem& problem, const std::vector<fit::Prediction>& block) {
  Vector6 shown = Vector6::Zero(), applied = Vector6::Zero();
  for (const fit::Prediction& p : block) {
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
    const fit::Block& block = problem.blocks[b];
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
  const auto missing = fit::missing_loads(problem, judged.weighting.block);
  for (const Vector6& combination : missing) out.missing.push_back(fit::missing_name(combination));
  const auto known = fit::axis_knowledge(problem, out.model.K, judged.solution.covariance);
  for (std::size_t i = 0; i < 6; ++i) {
    AxisFit& axis = out.axis[i];
    const auto row = static_cast<int>(i);
    for (const fit::Row& r : problem.rows) {
      if (judged.weighting.block[static_cast<std::size_t>(r.block)] > 0)
        axis.largest = std::max(axis.largest, std::abs(r.wrench[row]));
    }
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
      axis.reason = fit::missing_reason(row, missing, axis.gain_sigma);
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
                   [](const AxisFit& axis) { return axis.state == AxisState::calibrated; })) {
    return;
  }
  for (std::size_t i = 0; i < 6; ++i) {
    const AxisFit& axis = fitted.axis[i];
    const double off = std::hypot(axis.error_constant, axis.error_proportional) /
                       problem.scale[static_cast<int>(i)];
    if (axis.largest == 0 || off < kGrossError) continue;
    throw ConfigError(fmt::format(
        "calibration: the steps contradict each other by {:.0f} % of full load in {}, whichever "
        "few are left out; check masses, points and directions of the plan, then take the steps "
        "again",
        100 * off, kWrenchAxes[i]));
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
  throw ConfigError(
      fmt::format("calibration: {}; add steps that load it, or let the spring model complete it",
                  fmt::join(lacking, ", ")));
}

}  // namespace

WrenchFit fit_wrench(std::span<const Observation> observations, std::span<const PathPoint> path,
                     const FitOptions& options) {
  Problem problem = fit::make_problem(observations, path, {}, options.prior, options.prior_width);
  assume_reciprocity(problem, options);
  WrenchFit out;
  const fit::Explanation explanation = fit::explain(problem);
  Judged judged = fit::judge_explained(problem, explanation, out.warnings);
  if (!explanation.found) {
    out.warnings.push_back(
        "the steps contradict each other, and no few of them explain it: the errors below are what "
        "they disagree by; check masses, points and directions of the plan");
  }
  if (options.try_richer) {
    out.trials = fit::try_richer(problem, judged, observations, path);
    for (const ModelTrial& trial : out.trials) {
      if (!trial.adopted) continue;
      problem = fit::with_features(problem, observations, path, trial.features);
      judged = fit::judge(problem, explanation.left_out);
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
                   [](const Observation& o) { return o.wrench.squaredNorm() > 0; })) {
    return Vector6::Zero();
  }
  const Problem problem = fit::make_problem(observations, {}, {}, stiffness, prior_width);
  constexpr double kModelError =
      0.005;  // of the load: no answer is better than a small model error
  const fit::Weighting weighting{.error = {Vector6::Zero(), kModelError * problem.scale},
                                 .block = std::vector<double>(problem.blocks.size(), 1.0)};
  const auto known =
      fit::axis_knowledge(problem, stiffness, fit::solve(problem, weighting, {}).covariance);
  Vector6 out;
  for (int i = 0; i < 6; ++i) out[i] = known[static_cast<std::size_t>(i)].coverage;
  return out;
}

}  // namespace tagwrench
