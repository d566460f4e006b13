// What analyze() is made of, in its order: trials are checked, readings paired with the reference,
// fitted, held out and measured; then people are warned. Seen by this room alone.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "host/calibration/analysis/analysis.h"

namespace tagwrench::study {

inline constexpr double kGapsOfMedian = 5;  ///< an interval this long is a gap

/// A trial that has been checked, its reference filtered as its readings will be.
struct CleanTrial : Trial {
  Eigen::VectorXd noise;    ///< 6, standard deviation of the reference before it was filtered
  Eigen::VectorXd quantum;  ///< 6, step that it counts in, or 0
  double longest_gap = 0;   ///< s, that the reference is interpolated across
};

/// Without its backlog and its dropped start; smoothed reference where asked for. What was noticed
/// goes to `warnings`. Throws ConfigError: columns of different lengths, numbers that are not
/// finite, times that do not grow, no reading within the time of the reference.
CleanTrial check_trial(const Trial& trial, const AnalysisOptions& options,
                       std::vector<std::string>& warnings);

/// Readings that follow each other, of one trial.
struct Range {
  std::size_t trial = 0;
  Eigen::Index first = 0, count = 0;
};

/// Readings of some ranges and what the reference felt then.
struct Rows {
  Eigen::VectorXd time;              ///< k
  Eigen::MatrixXd features;          ///< k x p
  Eigen::MatrixXd felt;              ///< k x 6
  Eigen::VectorXi segment;           ///< k: rows of one number follow each other without a gap
  Eigen::MatrixXd predicted, sigma;  ///< k x 6, that the trials brought, NaN where none; or 0 x 6
};

/// Those with a reference at that lag. If `smooth`, each range by itself: nothing outside of it
/// gets in; or, if `in_context`, with the reading before and after the range, as an instrument does
/// that runs.
Rows rows_of(const std::vector<CleanTrial>& trials, const std::vector<Range>& ranges, double lag,
             bool smooth, bool in_context = false);

/// One lag for all, by all axes of the reference or one alone; that of what hangs there is 0, and
/// known.
Lag lag_of(const std::vector<CleanTrial>& trials, const std::vector<Range>& ranges,
           const AnalysisOptions& options, int axis = -1);

/// Linear regression of a reference on features, standardised, with an optional ridge.
struct LinearModel {
  Eigen::VectorXd mean;      ///< p, of the features
  Eigen::VectorXd scale;     ///< p, 1 / standard deviation; 0 for a feature that never changed
  Eigen::MatrixXd weights;   ///< p x q, of standardised features
  Eigen::VectorXd offset;    ///< q
  Eigen::MatrixXd inverse;   ///< p x p, of (Z^T Z + ridge n I)
  Eigen::VectorXd variance;  ///< q, of the residuals, by their degrees of freedom
  double condition = 0;      ///< of the standardised features, those that never changed apart
  Eigen::Index rows = 0;

  Eigen::MatrixXd predict(const Eigen::MatrixXd& features) const;
  /// Standard deviation of the error of each prediction, fit and residuals together: k x q.
  Eigen::MatrixXd sigma(const Eigen::MatrixXd& features) const;
  /// q x p: y = matrix() * features + constant()
  Eigen::MatrixXd matrix() const { return weights.transpose() * scale.asDiagonal(); }
  Eigen::VectorXd constant() const { return offset - matrix() * mean; }
};

/// Least squares with the penalty ridge * n * |weights|^2 on standardised features. Combinations of
/// features that never changed get no weight. Needs two rows at least.
LinearModel fit_linear(const Eigen::MatrixXd& features, const Eigen::MatrixXd& values,
                       double ridge);

double standard_deviation(const Eigen::VectorXd& values);

/// 1 - squares of the errors / squares about the mean, per column; NaN where nothing changed.
Eigen::VectorXd r_squared(const Eigen::MatrixXd& predicted, const Eigen::MatrixXd& truth);

/// Root mean square of the errors, per column.
Eigen::VectorXd rms_error(const Eigen::MatrixXd& predicted, const Eigen::MatrixXd& truth);

/// Range, excitation and independence of each axis: fills AxisReport's range_*, full_scale,
/// reference_noise, excitation, independent, calibrated and reason, and Analysis' weakest*.
/// `felt`: k x 6, of all readings.
void judge_excitation(const Eigen::MatrixXd& felt, const Eigen::VectorXd& noise,
                      Analysis& analysis);

/// From Analysis' held-out series and ranges: scores, non-linearity, hysteresis (NaN where the data
/// are too few), coverage and cross_talk.
void measure_held_out(Analysis& analysis);

/// Noise, drift and creep where the load stands still, of all readings as predicted by the fit to
/// all of them; `one_clock`: times of all segments go on.
void measure_rest(const Rows& all, bool one_clock, Analysis& analysis);

/// Adds to Analysis::warnings: lag, axes that were hardly loaded or only together, coarse steps of
/// the reference, channels filtered differently, clocks that run apart, a reference of the wrong
/// sign.
void add_warnings(const std::vector<CleanTrial>& trials, const Rows& all,
                  const AnalysisOptions& options, Analysis& analysis);

}  // namespace tagwrench::study
