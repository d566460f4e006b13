#include "host/calibration/analysis/analysis_warnings.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "host/calibration/analysis/smoothing.h"
#include "host/calibration/analysis/trial_check.h"
#include "host/calibration/analysis/trial_csv.h"
#include "host/core/axis_names.h"

namespace tagwrench::study {
namespace {

constexpr double kLittleIndependent = 5;  // of the reference's noise
constexpr double kWeakShare = 0.1;        // of what independent axes would have
constexpr double kGoodAxis = 0.98;        // R^2 of an axis that can tell a lag
constexpr double kBothWays = 0.1;         // of full scale
constexpr double kApart = 3;              // sigmas
constexpr Eigen::Index kMinToSplit = 90;  // readings

constexpr double kFewInside = 0.85;  // within intervals that are to hold 95 %

void warn_of_dependence(Analysis& analysis) {
  std::vector<std::string> together;
  double least = kLittleIndependent;
  double most = 0;
  for (std::size_t k = 0; k < 6; ++k) {
    const AxisReport& axis = analysis.axis[k];
    if (!axis.calibrated || axis.independent >= kLittleIndependent) continue;
    together.push_back(kWrenchAxes[k]);
    least = std::min(least, axis.independent);
    most = std::max(most, axis.independent);
  }
  if (together.empty()) return;
  analysis.warnings.push_back(fmt::format(
      "{}: loaded almost only together with other axes: by itself {} times the reference's noise; "
      "figures hold for loads like these alone",
      fmt::join(together, " "),
      together.size() > 1 ? fmt::format("{:.1f} to {:.1f}", least, most)
                          : fmt::format("{:.1f}", least)));
}

void warn_of_excitation(Analysis& analysis) {
  for (std::string& line : excitation_warnings(analysis))
    analysis.warnings.push_back(std::move(line));
  warn_of_dependence(analysis);
  std::vector<std::string> one_way;
  for (std::size_t k = 0; k < 6; ++k) {
    const AxisReport& axis = analysis.axis[k];
    const double less = std::min(std::max(0.0, axis.range_high), std::max(0.0, -axis.range_low));
    if (axis.full_scale > 0 && less < kBothWays * axis.full_scale)
      one_way.push_back(kWrenchAxes[k]);
  }
  if (!one_way.empty()) {
    analysis.warnings.push_back(fmt::format(
        "{}: loaded one way only; what holds the other way is not known", fmt::join(one_way, " ")));
  }
  if (!analysis.weakest.empty() && analysis.weakest_share < kWeakShare) {
    analysis.warnings.push_back(fmt::format(
        "the combination {} was hardly excited: {:.1f} % of what independent axes would have",
        analysis.weakest, 100 * analysis.weakest_share));
  }
}

void warn_of_steps(Analysis& analysis) {
  std::vector<std::string> axes;
  std::vector<std::string> steps;
  for (std::size_t k = 0; k < 6; ++k) {
    const AxisReport& axis = analysis.axis[k];
    const double step = axis.reference_step;
    if (axis.full_scale > 0 && step > 0.02 * axis.full_scale) {
      axes.push_back(kWrenchAxes[k]);
      steps.push_back(
          fmt::format("{:.2g} {} ({:.0f} %)", step, kAxisUnits[k], 100 * step / axis.full_scale));
    }
  }
  if (axes.empty()) return;
  analysis.warnings.push_back(
      fmt::format("{}: the reference counts in steps of {} of the range here", fmt::join(axes, " "),
                  fmt::join(steps, ", ")));
}

/// The readings of a trial and one axis of its reference, or all of them.
Segment segment_of(const CleanTrial& trial, Eigen::Index first, Eigen::Index count, int axis,
                   bool smooth) {
  Segment segment;
  segment.time = trial.time.segment(first, count);
  segment.features = trial.features.middleRows(first, count);
  if (smooth) segment.features = smooth_rows(segment.features);
  segment.reference_time = trial.reference_time;
  if (axis < 0) {
    segment.reference = trial.reference;
  } else {
    segment.reference = trial.reference.col(axis);
  }
  return segment;
}

void warn_of_channels(const std::vector<CleanTrial>& trials, const AnalysisOptions& options,
                      Analysis& analysis) {
  const CleanTrial& trial = trials[0];
  if (trial.held || trial.step.size() > 0) return;
  const double interval = median_interval(trial.time);
  std::vector<std::string> apart;
  for (std::size_t k = 0; k < 6; ++k) {
    const AxisReport& axis = analysis.axis[k];
    if (!axis.calibrated) continue;
    const Segment one =
        segment_of(trial, 0, trial.time.size(), static_cast<int>(k), options.smooth);
    const Lag lag = estimate_lag({&one, 1}, {options.lag_from, options.lag_to,
                                             std::max(1e-6, options.ridge), !options.smooth});
    const double difference = lag.value - analysis.lag.value;
    if (lag.known && lag.explained > kGoodAxis &&
        std::abs(difference) > kApart * std::hypot(lag.sigma, analysis.lag.sigma) &&
        std::abs(difference) > interval / 2)
      apart.push_back(fmt::format("{} {:.0f} ms", kWrenchAxes[k], 1e3 * lag.value));
  }
  if (apart.empty()) return;
  analysis.warnings.push_back(
      fmt::format("by itself each axis lags differently ({}; all together {:.0f} ms): are some "
                  "channels filtered and others not?",
                  fmt::join(apart, ", "), 1e3 * analysis.lag.value));
}

void warn_of_clocks(const std::vector<CleanTrial>& trials, const AnalysisOptions& options,
                    Analysis& analysis) {
  for (std::size_t t = 0; t < trials.size(); ++t) {
    const CleanTrial& trial = trials[t];
    const Eigen::Index third = trial.time.size() / 3;
    if (trial.held || trial.step.size() > 0 || trial.time.size() < kMinToSplit) continue;
    const LagSearch search{options.lag_from, options.lag_to, std::max(1e-6, options.ridge),
                           !options.smooth};
    const Segment begin = segment_of(trial, 0, third, -1, options.smooth);
    const Segment end = segment_of(trial, trial.time.size() - third, third, -1, options.smooth);
    const Lag first = estimate_lag({&begin, 1}, search);
    const Lag last = estimate_lag({&end, 1}, search);
    const double change = last.value - first.value;
    if (!first.known || !last.known ||
        std::abs(change) <= kApart * std::hypot(first.sigma, last.sigma) ||
        std::abs(change) < median_interval(trial.time) / 4)
      continue;
    analysis.warnings.push_back(fmt::format(
        "{}: the lag goes from {:.1f} to {:.1f} ms: the two clocks run apart; bring both to one",
        analysis.names[t], 1e3 * first.value, 1e3 * last.value));
  }
}

/// Springs push back the way they were pushed: of a displacement, each axis of the load goes with
/// its own translation or rotation.
void warn_of_sign(const std::vector<Range>& ranges, const std::vector<CleanTrial>& trials,
                  const AnalysisOptions& options, Analysis& analysis) {
  if (analysis.feature_names != displacement_names()) return;
  const Rows rows = rows_of(trials, ranges, analysis.lag.value,
                            options.smooth ? Smoothing::apart : Smoothing::none);
  int with = 0;
  int against = 0;
  for (Eigen::Index k = 0; k < 6; ++k) {
    if (!analysis.axis[static_cast<std::size_t>(k)].calibrated) continue;
    const Eigen::VectorXd moved = rows.features.col(k).array() - rows.features.col(k).mean();
    const Eigen::VectorXd felt = rows.felt.col(k).array() - rows.felt.col(k).mean();
    const double together = moved.dot(felt) / (moved.norm() * felt.norm() + 1e-300);
    with += together > 0.3 ? 1 : 0;
    against += together < -0.3 ? 1 : 0;
  }
  if (against > with) {
    analysis.warnings.push_back(fmt::format(
        "the platform moves against the load on {} of {} axes: is the reference's sign reversed?",
        against, with + against));
  }
}

}  // namespace

std::vector<std::string> excitation_warnings(const Analysis& analysis) {
  std::vector<std::string> reasons;
  std::vector<std::string> axes;
  for (std::size_t k = 0; k < 6; ++k) {
    const AxisReport& axis = analysis.axis[k];
    if (axis.calibrated) continue;
    const auto known = std::find(reasons.begin(), reasons.end(), axis.reason);
    if (known != reasons.end()) {
      axes[static_cast<std::size_t>(known - reasons.begin())] += fmt::format(" {}", kWrenchAxes[k]);
    } else {
      reasons.push_back(axis.reason);
      axes.emplace_back(kWrenchAxes[k]);
    }
  }
  const char* verdict = analysis.own_predictions ? "" : "not calibrated: ";
  std::vector<std::string> lines;
  for (std::size_t i = 0; i < axes.size(); ++i)
    lines.push_back(fmt::format("{}: {}{}", axes[i], verdict, reasons[i]));
  return lines;
}

std::vector<std::string> coverage_warnings(const Analysis& analysis) {
  std::vector<std::string> parts;
  for (std::size_t k = 0; k < 6; ++k) {
    const AxisReport& axis = analysis.axis[k];
    if (axis.calibrated && axis.coverage && *axis.coverage < kFewInside)
      parts.push_back(fmt::format("{} {:.0f} %", kWrenchAxes[k], 100 * *axis.coverage));
  }
  if (parts.empty()) return {};
  return {
      fmt::format("few errors lie within the stated 95 % intervals ({}): the true uncertainty is "
                  "larger than stated",
                  fmt::join(parts, ", "))};
}

void add_warnings(const std::vector<CleanTrial>& trials, const std::vector<Range>& ranges,
                  const AnalysisOptions& options, Analysis& analysis) {
  const bool instrument = std::any_of(trials.begin(), trials.end(),
                                      [](const CleanTrial& trial) { return !trial.held; });
  if (options.fit_lag && instrument) {
    const std::string lag = lag_warning(analysis.lag, options.usual_lag_from, options.usual_lag_to);
    if (!lag.empty()) analysis.warnings.push_back(lag);
    warn_of_channels(trials, options, analysis);
    warn_of_clocks(trials, options, analysis);
  }
  warn_of_excitation(analysis);
  for (std::string& line : coverage_warnings(analysis))
    analysis.warnings.push_back(std::move(line));
  warn_of_steps(analysis);
  warn_of_sign(ranges, trials, options, analysis);
}

}  // namespace tagwrench::study
