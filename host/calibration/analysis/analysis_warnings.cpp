#include "host/calibration/analysis/analysis_warnings.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

#include "host/calibration/analysis/lag.h"
#include "host/calibration/analysis/trial_csv.h"
#include "host/core/axis_names.h"
#include "host/core/config_error.h"

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

namespace {

constexpr double kGapsOfMedian = 5;  // an interval this long is a gap
constexpr double kBacklogRate = 3;   // times the median rate
constexpr Eigen::Index kMinBacklog = 5;
constexpr double kRepeatedShare = 0.02;  // of readings, that is worth a word
constexpr double kStuckSeconds = 0.2;    // at its extreme
constexpr double kFineSteps = 200;       // in the range: coarser ones stand still by themselves

void check_times(const Eigen::VectorXd& time, const std::string& name, const char* what) {
  for (Eigen::Index i = 0; i < time.size(); ++i) {
    if (!std::isfinite(time[i]))
      throw ConfigError(fmt::format("{}: {} {}: its time is no finite number", name, what, i + 1));
    if (i > 0 && time[i] <= time[i - 1]) {
      throw ConfigError(fmt::format("{}: {} {}: time {} s after {} s; times must grow", name, what,
                                    i + 1, time[i], time[i - 1]));
    }
  }
}

void check_shapes(const Trial& trial) {
  const Eigen::Index n = trial.time.size();
  const Eigen::Index m = trial.reference_time.size();
  if (trial.features.rows() != n || trial.features.cols() == 0 || trial.reference.rows() != m ||
      trial.reference.cols() != 6 || (trial.step.size() > 0 && trial.step.size() != n) ||
      (trial.predicted.size() > 0 &&
       (trial.predicted.rows() != n || trial.predicted.cols() != 6 ||
        trial.predicted_sigma.rows() != n || trial.predicted_sigma.cols() != 6))) {
    throw ConfigError(
        fmt::format("{}: columns of different lengths, or none; write it anew", trial.name));
  }
  if (n < 2 || m < 2) {
    throw ConfigError(
        fmt::format("{}: {} readings and {} of the reference; at least two of each "
                    "are needed",
                    trial.name, n, m));
  }
  if (!trial.features.allFinite() || !trial.reference.allFinite())
    throw ConfigError(
        fmt::format("{}: numbers that are not finite; leave those rows out", trial.name));
}

void note_gaps(const Eigen::VectorXd& time, const std::string& name, const char* what,
               std::vector<std::string>& warnings) {
  const double median = median_interval(time);
  int gaps = 0;
  int bursts = 0;
  double longest = 0;
  for (Eigen::Index i = 1; i < time.size(); ++i) {
    const double interval = time[i] - time[i - 1];
    if (interval > kGapsOfMedian * median) ++gaps;
    if (interval > longest) longest = interval;
    if (interval < median / kBacklogRate) ++bursts;
  }
  if (gaps > 0) {
    warnings.push_back(
        fmt::format("{}: {} gap{} in the {}, the longest {:.2f} s; nothing is "
                    "interpolated across them",
                    name, gaps, gaps == 1 ? "" : "s", what, longest));
  }
  if (bursts > 0.05 * static_cast<double>(time.size())) {
    warnings.push_back(
        fmt::format("{}: {} of {} {} are stamped in bursts, less than {:.1f} ms "
                    "apart: stamped on arrival, not when taken?",
                    name, bursts, time.size(), what, 1e3 * median / kBacklogRate));
  }
}

/// Leaves out the first rows of both readings or reference.
Eigen::Index drop_backlog(const Eigen::VectorXd& time, const std::string& name, const char* what,
                          std::vector<std::string>& warnings) {
  const Eigen::Index rows = backlog_rows(time);
  if (rows == 0) return 0;
  warnings.push_back(fmt::format(
      "{}: the first {} {} are stamped within {:.0f} ms, the rest {:.1f} ms apart: a backlog from "
      "before; left out",
      name, rows, what, 1e3 * (time[rows - 1] - time[0]), 1e3 * median_interval(time)));
  return rows;
}

void note_columns(const CleanTrial& clean, const Trial& trial, std::vector<std::string>& warnings) {
  for (Eigen::Index j = 0; j < clean.features.cols(); ++j) {
    const auto column = clean.features.col(j);
    if (column.maxCoeff() == column.minCoeff()) {
      warnings.push_back(fmt::format("{}: {} never changes; it is left out", trial.name,
                                     trial.feature_names.size() > static_cast<std::size_t>(j)
                                         ? trial.feature_names[static_cast<std::size_t>(j)]
                                         : fmt::format("feature {}", j + 1)));
    }
  }
  Eigen::Index repeated = 0;
  for (Eigen::Index i = 1; i < clean.features.rows(); ++i)
    repeated += clean.features.row(i) == clean.features.row(i - 1) ? 1 : 0;
  if (static_cast<double>(repeated) >
      std::max(3.0, kRepeatedShare * static_cast<double>(clean.features.rows()))) {
    warnings.push_back(
        fmt::format("{}: {} of {} readings repeat the one before exactly: pictures "
                    "that came twice?",
                    trial.name, repeated, clean.features.rows()));
  }
}

void note_saturation(const CleanTrial& clean, const std::string& name,
                     std::vector<std::string>& warnings) {
  const double period = median_interval(clean.reference_time);
  for (Eigen::Index k = 0; k < 6; ++k) {
    const Eigen::VectorXd values = clean.reference.col(k);
    const double low = values.minCoeff();
    const double high = values.maxCoeff();
    const double step = quantisation_step(values);
    if (high == low || (step > 0 && (high - low) / step < kFineSteps)) continue;
    for (const double extreme : {low, high}) {
      // Zero exactly, again and again, is what an unloaded ideal reference says.
      if (extreme == 0) continue;
      Eigen::Index run = 0;
      Eigen::Index longest = 0;
      for (const double value : values) {
        run = value == extreme ? run + 1 : 0;
        longest = std::max(longest, run);
      }
      if (longest >= 5 && static_cast<double>(longest) * period > kStuckSeconds) {
        warnings.push_back(fmt::format(
            "{}: the reference's {} stays at its {} of {:.4g} {} for "
            "{:.2f} s: saturated?",
            name, kWrenchAxes[static_cast<std::size_t>(k)], extreme == low ? "least" : "most",
            extreme, kAxisUnits[static_cast<std::size_t>(k)],
            static_cast<double>(longest) * period));
      }
    }
  }
}

void check_overlap(const CleanTrial& clean, const AnalysisOptions& options,
                   const std::string& name) {
  const double first = clean.reference_time[0];
  const double last = clean.reference_time[clean.reference_time.size() - 1];
  const bool overlaps = clean.time[clean.time.size() - 1] - options.lag_from >= first &&
                        clean.time[0] - options.lag_to <= last;
  if (!overlaps) {
    throw ConfigError(fmt::format(
        "{}: readings from {:.3f} to {:.3f} s, the reference from {:.3f} to {:.3f} s: no overlap; "
        "both need one clock, check the units of time",
        name, clean.time[0], clean.time[clean.time.size() - 1], first, last));
  }
}

}  // namespace

Eigen::Index backlog_rows(const Eigen::VectorXd& time) {
  const double fast = median_interval(time) / kBacklogRate;
  Eigen::Index rows = 0;
  for (Eigen::Index i = 1; i < time.size() / 2; ++i) {
    if (time[i] - time[0] >= fast * static_cast<double>(i)) break;
    if (time[i] - time[i - 1] < fast) rows = i;
  }
  return rows >= kMinBacklog ? rows : 0;
}

double quantisation_step(const Eigen::VectorXd& values) {
  std::vector<double> sorted(values.begin(), values.end());
  std::sort(sorted.begin(), sorted.end());
  const double span = sorted.back() - sorted.front();
  double step = std::numeric_limits<double>::infinity();
  int levels = 1;
  for (std::size_t i = 1; i < sorted.size(); ++i) {
    const double difference = sorted[i] - sorted[i - 1];
    if (difference <= 1e-9 * span) continue;
    step = std::min(step, difference);
    ++levels;
  }
  // A few levels are loads that were applied, not counts.
  constexpr int kMinLevels = 12;
  if (levels < kMinLevels) return 0;
  constexpr double kTolerance = 0.02;
  for (std::size_t i = 1; i < sorted.size(); ++i) {
    const double steps = (sorted[i] - sorted[i - 1]) / step;
    if (std::abs(steps - std::round(steps)) > kTolerance) return 0;
  }
  return step;
}

double column_noise(const Eigen::VectorXd& values) {
  constexpr Eigen::Index kWindow = 20;
  constexpr double kGain = 20;  // 1 + 9 + 9 + 1: variance of third differences of white noise
  std::vector<double> variances;
  for (Eigen::Index first = 0; first + kWindow <= values.size(); first += kWindow) {
    const Eigen::Index n = kWindow - 3;
    const auto w = values.segment(first, kWindow);
    const Eigen::VectorXd third =
        w.segment(3, n) - 3 * w.segment(2, n) + 3 * w.segment(1, n) - w.head(n);
    variances.push_back(third.squaredNorm() / (kGain * static_cast<double>(n)));
  }
  double noise = 0;
  if (!variances.empty()) {
    const auto middle = variances.begin() + static_cast<std::ptrdiff_t>(variances.size() / 2);
    std::nth_element(variances.begin(), middle, variances.end());
    noise = std::sqrt(*middle);
  }
  return std::max(noise, quantisation_step(values) / std::sqrt(12.0));
}

CleanTrial check_trial(const Trial& trial, const AnalysisOptions& options,
                       std::vector<std::string>& warnings) {
  check_shapes(trial);
  check_times(trial.time, trial.name, "reading");
  check_times(trial.reference_time, trial.name, "row of the reference");

  Eigen::Index first = 0;
  Eigen::Index reference_first = 0;
  if (options.drop_backlog && !trial.held) {
    first = drop_backlog(trial.time, trial.name, "readings", warnings);
    reference_first =
        drop_backlog(trial.reference_time, trial.name, "rows of the reference", warnings);
  }
  const double start = trial.time[first] + options.drop_start;
  while (first < trial.time.size() && trial.time[first] < start) ++first;
  const Eigen::Index n = trial.time.size() - first;
  const Eigen::Index m = trial.reference_time.size() - reference_first;
  if (n < 2)
    throw ConfigError(fmt::format("{}: dropping {} s leaves no readings; drop less", trial.name,
                                  options.drop_start));

  CleanTrial clean;
  clean.held = trial.held;
  clean.time = trial.time.tail(n);
  clean.features = trial.features.bottomRows(n);
  if (trial.step.size() > 0) clean.step = trial.step.tail(n);
  if (trial.predicted.size() > 0) {
    clean.predicted = trial.predicted.bottomRows(n);
    clean.predicted_sigma = trial.predicted_sigma.bottomRows(n);
  }
  clean.reference_time = trial.reference_time.tail(m);
  clean.reference = trial.reference.bottomRows(m);
  clean.longest_gap = trial.held ? std::numeric_limits<double>::infinity()
                                 : kGapsOfMedian * median_interval(clean.reference_time);
  check_overlap(clean, options, trial.name);
  if (!trial.held) {
    if (trial.step.size() == 0) note_gaps(clean.time, trial.name, "readings", warnings);
    if (trial.step.size() == 0) note_gaps(clean.reference_time, trial.name, "reference", warnings);
    note_saturation(clean, trial.name, warnings);
  }
  note_columns(clean, trial, warnings);
  clean.noise = Eigen::VectorXd::Zero(6);
  clean.quantum = Eigen::VectorXd::Zero(6);
  for (Eigen::Index k = 0; k < 6 && !trial.held; ++k) {
    clean.quantum[k] = quantisation_step(clean.reference.col(k));
    clean.noise[k] = column_noise(clean.reference.col(k));
  }
  if (options.smooth && !trial.held) {
    clean.reference =
        smooth_reference(clean.reference_time, clean.reference, median_interval(clean.time));
  }
  return clean;
}

}  // namespace tagwrench::study
