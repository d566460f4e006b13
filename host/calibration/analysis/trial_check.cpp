#include "host/calibration/analysis/trial_check.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "host/calibration/analysis/smoothing.h"
#include "host/core/axis_names.h"
#include "host/core/config_error.h"

namespace tagwrench::study {
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
