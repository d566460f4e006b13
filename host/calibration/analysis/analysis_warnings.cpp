// What is wrong with a trial, before anything is computed from it, and what a person should be told
// about data that could be analyzed all the same.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "host/calibration/analysis/analysis_steps.h"
#include "host/core/config_error.h"
#include "host/core/robust_statistics.h"

namespace tagwrench::study {
namespace {

constexpr double kBacklogRate = 3;  // times the median rate
constexpr Eigen::Index kMinBacklog = 5;
constexpr double kRepeatedShare = 0.02;  // of readings, that is worth a word
constexpr double kStuckSeconds = 0.2;    // at its extreme
constexpr double kFineSteps = 200;       // in the range: coarser ones stand still by themselves

using Warnings = std::vector<std::string>;

template <class... Args>
void warn(Warnings& warnings, fmt::format_string<Args...> text, Args&&... args) {
  warnings.push_back(fmt::format(text, std::forward<Args>(args)...));
}

void check_shapes(const Trial& trial) {
  const Eigen::Index n = trial.time.size(), m = trial.reference_time.size();
  if (!shapes_fit(trial) || trial.features.cols() == 0)
    throw ConfigError("{}: columns of different lengths, or none; write it anew", trial.name);
  if (n < 2 || m < 2) {
    throw ConfigError("{}: {} readings and {} of the reference; at least two of each are needed",
                      trial.name, n, m);
  }
  if (!trial.features.allFinite() || !trial.reference.allFinite())
    throw ConfigError("{}: numbers that are not finite; leave those rows out", trial.name);
}

void check_times(const Eigen::VectorXd& time, const std::string& name, const char* what) {
  for (Eigen::Index i = 0; i < time.size(); ++i) {
    if (!std::isfinite(time[i]))
      throw ConfigError("{}: {} {}: its time is no finite number", name, what, i + 1);
    if (i > 0 && time[i] <= time[i - 1]) {
      throw ConfigError("{}: {} {}: time {} s after {} s; times must grow", name, what, i + 1,
                        time[i], time[i - 1]);
    }
  }
}

/// Rows at the start that were stamped at least three times as fast as the median rate: what had
/// queued up before anyone read it. The last of a run has the interval of the rest after it.
Eigen::Index backlog_rows(const Eigen::VectorXd& time, const std::string& name, const char* what,
                          Warnings& warnings) {
  const double median = median_interval(time);
  const double fast = median / kBacklogRate;
  Eigen::Index rows = 0;
  for (Eigen::Index i = 1; i < time.size() / 2; ++i) {
    if (time[i] - time[0] >= fast * static_cast<double>(i)) break;
    if (time[i] - time[i - 1] < fast) rows = i;
  }
  if (rows < kMinBacklog) return 0;
  warn(warnings,
       "{}: the first {} {} are stamped within {:.0f} ms, the rest {:.1f} ms apart: a backlog from "
       "before; left out",
       name, rows, what, 1e3 * (time[rows - 1] - time[0]), 1e3 * median);
  return rows;
}

void note_gaps(const Eigen::VectorXd& time, const std::string& name, const char* what,
               Warnings& warnings) {
  const Eigen::ArrayXd intervals = time.tail(time.size() - 1) - time.head(time.size() - 1);
  const double median = median_interval(time);
  const auto gaps = (intervals > kGapsOfMedian * median).count();
  const auto bursts = (intervals < median / kBacklogRate).count();
  if (gaps > 0) {
    warn(warnings,
         "{}: {} gap{} in the {}, the longest {:.2f} s; nothing is interpolated across them", name,
         gaps, gaps == 1 ? "" : "s", what, intervals.maxCoeff());
  }
  if (static_cast<double>(bursts) > 0.05 * static_cast<double>(time.size())) {
    warn(warnings,
         "{}: {} of {} {} are stamped in bursts, less than {:.1f} ms apart: stamped on arrival, "
         "not when taken?",
         name, bursts, time.size(), what, 1e3 * median / kBacklogRate);
  }
}

void note_columns(const CleanTrial& clean, Warnings& warnings) {
  for (Eigen::Index j = 0; j < clean.features.cols(); ++j) {
    const auto column = clean.features.col(j);
    if (column.maxCoeff() == column.minCoeff())
      warn(warnings, "{}: {} never changes; it is left out", clean.name, clean.feature_names[j]);
  }
  const Eigen::Index n = clean.features.rows();
  Eigen::Index repeated = 0;
  for (Eigen::Index i = 1; i < n; ++i)
    repeated += clean.features.row(i) == clean.features.row(i - 1) ? 1 : 0;
  if (static_cast<double>(repeated) > std::max(3.0, kRepeatedShare * static_cast<double>(n))) {
    warn(warnings, "{}: {} of {} readings repeat the one before exactly: pictures that came twice?",
         clean.name, repeated, n);
  }
}

/// The smallest step between values of a column if all differences are multiples of it and it shows
/// enough levels, else 0.
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

/// Standard deviation of the noise of a column, from third differences in the middle one of its
/// windows, which motion hardly reaches, and at least its step / sqrt(12).
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
  return std::max(std::sqrt(median(variances)), quantisation_step(values) / std::sqrt(12.0));
}

void note_saturation(const CleanTrial& clean, Warnings& warnings) {
  const double period = median_interval(clean.reference_time);
  for (int k = 0; k < 6; ++k) {
    const Eigen::VectorXd values = clean.reference.col(k);
    const double low = values.minCoeff(), high = values.maxCoeff();
    const double step = clean.quantum[k];
    if (high == low || (step > 0 && (high - low) / step < kFineSteps)) continue;
    for (const double extreme : {low, high}) {
      // Zero exactly, again and again, is what an unloaded ideal reference says.
      if (extreme == 0) continue;
      int run = 0, longest = 0;
      for (const double value : values) {
        run = value == extreme ? run + 1 : 0;
        longest = std::max(longest, run);
      }
      if (longest >= 5 && longest * period > kStuckSeconds) {
        warn(warnings,
             "{}: the reference's {} stays at its {} of {:.4g} {} for {:.2f} s: saturated?",
             clean.name, kWrenchAxes[k], extreme == low ? "least" : "most", extreme, kAxisUnits[k],
             longest * period);
      }
    }
  }
}

void check_overlap(const CleanTrial& clean, const AnalysisOptions& options) {
  const double first = clean.reference_time[0];
  const double last = clean.reference_time[clean.reference_time.size() - 1];
  const bool overlaps = clean.time[clean.time.size() - 1] - options.lag_from >= first &&
                        clean.time[0] - options.lag_to <= last;
  if (!overlaps) {
    throw ConfigError(
        "{}: readings from {:.3f} to {:.3f} s, the reference from {:.3f} to {:.3f} s: no overlap; "
        "both need one clock, check the units of time",
        clean.name, clean.time[0], clean.time[clean.time.size() - 1], first, last);
  }
}

/// The last `n` readings and `m` rows of the reference.
void keep_last(Eigen::Index n, Eigen::Index m, Trial& trial) {
  const auto cut = [](auto& values, Eigen::Index rows) {
    if (values.rows() > 0) values = values.bottomRows(rows).eval();
  };
  cut(trial.time, n);
  cut(trial.features, n);
  cut(trial.feature_sigma, n);
  cut(trial.step, n);
  cut(trial.predicted, n);
  cut(trial.predicted_sigma, n);
  cut(trial.reference_time, m);
  cut(trial.reference, m);
  cut(trial.reference_sigma, m);
}

constexpr double kLittleIndependent = 5;  // of the reference's noise
constexpr double kWeakShare = 0.1;        // of what independent axes would have
constexpr double kGoodAxis = 0.98;        // R^2 of an axis that can tell a lag
constexpr double kBothWays = 0.1;         // of full scale
constexpr double kApart = 3;              // sigmas
constexpr Eigen::Index kMinToSplit = 90;  // readings
constexpr double kFewInside = 0.85;       // within intervals that are to hold 95 %
constexpr double kCoarseStep = 0.02;      // of full scale

void warn_of_dependence(Analysis& analysis) {
  std::vector<std::string> together;
  double least = kLittleIndependent, most = 0;
  for (int k = 0; k < 6; ++k) {
    const AxisReport& axis = analysis.axis[k];
    if (!axis.calibrated || axis.independent >= kLittleIndependent) continue;
    together.push_back(kWrenchAxes[k]);
    least = std::min(least, axis.independent);
    most = std::max(most, axis.independent);
  }
  if (together.empty()) return;
  const std::string times = together.size() > 1 ? fmt::format("{:.1f} to {:.1f}", least, most)
                                                : fmt::format("{:.1f}", least);
  warn(analysis.warnings,
       "{}: loaded almost only together with other axes: by itself {} times the reference's noise; "
       "figures hold for loads like these alone",
       fmt::join(together, " "), times);
}

void warn_of_excitation(Analysis& analysis) {
  for (const std::string& line : excitation_warnings(analysis)) analysis.warnings.push_back(line);
  warn_of_dependence(analysis);
  std::vector<std::string> one_way;
  for (int k = 0; k < 6; ++k) {
    const AxisReport& axis = analysis.axis[k];
    const double less = std::min(std::max(0.0, axis.range_high), std::max(0.0, -axis.range_low));
    if (axis.full_scale > 0 && less < kBothWays * axis.full_scale)
      one_way.push_back(kWrenchAxes[k]);
  }
  if (!one_way.empty()) {
    warn(analysis.warnings, "{}: loaded one way only; what holds the other way is not known",
         fmt::join(one_way, " "));
  }
  if (!analysis.weakest.empty() && analysis.weakest_share < kWeakShare) {
    warn(analysis.warnings,
         "the combination {} was hardly excited: {:.1f} % of what independent axes would have",
         analysis.weakest, 100 * analysis.weakest_share);
  }
}

void warn_of_steps(Analysis& analysis) {
  std::vector<std::string> axes, steps;
  for (int k = 0; k < 6; ++k) {
    const AxisReport& axis = analysis.axis[k];
    const double share = axis.reference_step / axis.full_scale;
    if (axis.full_scale == 0 || share <= kCoarseStep) continue;
    axes.push_back(kWrenchAxes[k]);
    steps.push_back(
        fmt::format("{:.2g} {} ({:.0f} %)", axis.reference_step, kAxisUnits[k], 100 * share));
  }
  if (axes.empty()) return;
  warn(analysis.warnings, "{}: the reference counts in steps of {} of the range here",
       fmt::join(axes, " "), fmt::join(steps, ", "));
}

void warn_of_channels(const std::vector<CleanTrial>& trials, const AnalysisOptions& options,
                      Analysis& analysis) {
  const CleanTrial& trial = trials[0];
  if (trial.held || trial.step.size() > 0) return;
  std::vector<std::string> apart;
  for (int k = 0; k < 6; ++k) {
    if (!analysis.axis[k].calibrated) continue;
    const Lag lag = lag_of(trials, {{0, 0, trial.time.size()}}, options, k);
    const double difference = std::abs(lag.value - analysis.lag.value);
    if (lag.known && lag.explained > kGoodAxis &&
        difference > kApart * std::hypot(lag.sigma, analysis.lag.sigma) &&
        difference > median_interval(trial.time) / 2)
      apart.push_back(fmt::format("{} {:.0f} ms", kWrenchAxes[k], 1e3 * lag.value));
  }
  if (apart.empty()) return;
  warn(analysis.warnings,
       "by itself each axis lags differently ({}; all together {:.0f} ms): are some channels "
       "filtered and others not?",
       fmt::join(apart, ", "), 1e3 * analysis.lag.value);
}

void warn_of_clocks(const std::vector<CleanTrial>& trials, const AnalysisOptions& options,
                    Analysis& analysis) {
  for (std::size_t t = 0; t < trials.size(); ++t) {
    const CleanTrial& trial = trials[t];
    const Eigen::Index third = trial.time.size() / 3;
    if (trial.held || trial.step.size() > 0 || trial.time.size() < kMinToSplit) continue;
    const Lag first = lag_of(trials, {{t, 0, third}}, options);
    const Lag last = lag_of(trials, {{t, trial.time.size() - third, third}}, options);
    const double change = std::abs(last.value - first.value);
    if (first.known && last.known && change > kApart * std::hypot(first.sigma, last.sigma) &&
        change >= median_interval(trial.time) / 4) {
      warn(analysis.warnings,
           "{}: the lag goes from {:.1f} to {:.1f} ms: the two clocks run apart; bring both to one",
           trial.name, 1e3 * first.value, 1e3 * last.value);
    }
  }
}

/// Springs push back the way they were pushed: of a displacement, each axis of the load goes with
/// its own translation or rotation.
void warn_of_sign(const Rows& all, Analysis& analysis) {
  if (analysis.feature_names != displacement_names()) return;
  int with = 0, against = 0;
  for (int k = 0; k < 6; ++k) {
    if (!analysis.axis[k].calibrated) continue;
    const Eigen::VectorXd moved = all.features.col(k).array() - all.features.col(k).mean();
    const Eigen::VectorXd felt = all.felt.col(k).array() - all.felt.col(k).mean();
    const double together = moved.dot(felt) / (moved.norm() * felt.norm() + 1e-300);
    with += together > 0.3 ? 1 : 0;
    against += together < -0.3 ? 1 : 0;
  }
  if (against > with) {
    warn(analysis.warnings,
         "the platform moves against the load on {} of {} axes: is the reference's sign reversed?",
         against, with + against);
  }
}

}  // namespace

CleanTrial check_trial(const Trial& trial, const AnalysisOptions& options, Warnings& warnings) {
  check_shapes(trial);
  check_times(trial.time, trial.name, "reading");
  check_times(trial.reference_time, trial.name, "row of the reference");
  Eigen::Index first = 0, reference_first = 0;
  if (options.drop_backlog && !trial.held) {
    first = backlog_rows(trial.time, trial.name, "readings", warnings);
    reference_first =
        backlog_rows(trial.reference_time, trial.name, "rows of the reference", warnings);
  }
  const double start = trial.time[first] + options.drop_start;
  while (first < trial.time.size() && trial.time[first] < start) ++first;
  if (first + 2 > trial.time.size())
    throw ConfigError("{}: dropping {} s leaves no readings; drop less", trial.name,
                      options.drop_start);

  CleanTrial clean{trial, Eigen::VectorXd::Zero(6), Eigen::VectorXd::Zero(6),
                   std::numeric_limits<double>::infinity()};
  keep_last(trial.time.size() - first, trial.reference_time.size() - reference_first, clean);
  check_overlap(clean, options);
  if (!trial.held) {
    clean.longest_gap = kGapsOfMedian * median_interval(clean.reference_time);
    for (int k = 0; k < 6; ++k) {
      clean.quantum[k] = quantisation_step(clean.reference.col(k));
      clean.noise[k] = column_noise(clean.reference.col(k));
    }
    if (trial.step.size() == 0) {
      note_gaps(clean.time, trial.name, "readings", warnings);
      note_gaps(clean.reference_time, trial.name, "reference", warnings);
    }
    note_saturation(clean, warnings);
  }
  note_columns(clean, warnings);
  if (options.smooth && !trial.held) {
    clean.reference =
        smooth_reference(clean.reference_time, clean.reference, median_interval(clean.time));
  }
  return clean;
}

Warnings excitation_warnings(const Analysis& analysis) {
  std::vector<std::pair<std::string, std::string>> axes_of_reasons;  // in the order of the axes
  for (int k = 0; k < 6; ++k) {
    const AxisReport& axis = analysis.axis[k];
    if (axis.calibrated) continue;
    const auto known = std::find_if(axes_of_reasons.begin(), axes_of_reasons.end(),
                                    [&](const auto& entry) { return entry.first == axis.reason; });
    if (known == axes_of_reasons.end())
      axes_of_reasons.emplace_back(axis.reason, kWrenchAxes[k]);
    else
      known->second += fmt::format(" {}", kWrenchAxes[k]);
  }
  Warnings lines;
  for (const auto& [reason, axes] : axes_of_reasons)
    warn(lines, "{}: {}{}", axes, analysis.own_predictions ? "" : "not calibrated: ", reason);
  return lines;
}

Warnings coverage_warnings(const Analysis& analysis) {
  std::vector<std::string> parts;
  for (int k = 0; k < 6; ++k) {
    const AxisReport& axis = analysis.axis[k];
    if (axis.calibrated && axis.coverage < kFewInside)
      parts.push_back(fmt::format("{} {:.0f} %", kWrenchAxes[k], 100 * axis.coverage));
  }
  if (parts.empty()) return {};
  return {fmt::format(
      "few errors lie within the stated 95 % intervals ({}): the true uncertainty is larger than "
      "stated",
      fmt::join(parts, ", "))};
}

void add_warnings(const std::vector<CleanTrial>& trials, const Rows& all,
                  const AnalysisOptions& options, Analysis& analysis) {
  if (std::any_of(trials.begin(), trials.end(), [](const Trial& trial) { return !trial.held; })) {
    const std::string lag = lag_warning(analysis.lag);
    if (!lag.empty()) analysis.warnings.push_back(lag);
    warn_of_channels(trials, options, analysis);
    warn_of_clocks(trials, options, analysis);
  }
  warn_of_excitation(analysis);
  for (const std::string& line : coverage_warnings(analysis)) analysis.warnings.push_back(line);
  warn_of_steps(analysis);
  warn_of_sign(all, analysis);
}

}  // namespace tagwrench::study
