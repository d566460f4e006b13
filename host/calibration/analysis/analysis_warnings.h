// What a person should be told about data that could be analyzed all the same.
#pragma once

#include <string>
#include <vector>

#include "host/calibration/analysis/analysis.h"
#include "host/calibration/analysis/cross_validation.h"

namespace tagwrench::study {

/// Lines about axes without figures of their own, one for all axes of one reason. Where the trials
/// brought predictions, figures there are, and the line says what the data alone would not show.
std::vector<std::string> excitation_warnings(const Analysis& analysis);

/// Of intervals that hold far fewer errors than they say; empty if none.
std::vector<std::string> coverage_warnings(const Analysis& analysis);

/// Adds to Analysis::warnings: lag, axes that were hardly loaded or only together, coarse steps of
/// the reference, channels filtered differently, clocks that run apart, a reference of the wrong
/// sign.
void add_warnings(const std::vector<CleanTrial>& trials, const std::vector<Range>& ranges,
                  const AnalysisOptions& options, Analysis& analysis);

// What is wrong with a trial, before anything is computed from it.

/// Rows at the start that were stamped at least three times as fast as the median rate: what had
/// queued up before anyone read it. The last of a run has the interval of the rest after it.
Eigen::Index backlog_rows(const Eigen::VectorXd& time);

/// The smallest step between values of a column if all differences are multiples of it and it
/// shows at least twelve levels, else 0.
double quantisation_step(const Eigen::VectorXd& values);

/// Standard deviation of the noise of a column, from third differences in the middle one of its
/// windows, which motion hardly reaches, and at least its step / sqrt(12).
double column_noise(const Eigen::VectorXd& values);

/// Checked, without its backlog and its dropped start; smoothed reference where asked for. What was
/// noticed goes to `warnings`. Throws ConfigError: columns of different lengths, numbers that are
/// not finite, times that do not grow, no reading within the time of the reference.
CleanTrial check_trial(const Trial& trial, const AnalysisOptions& options,
                       std::vector<std::string>& warnings);

}  // namespace tagwrench::study
