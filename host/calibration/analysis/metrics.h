// What held-out predictions say about an instrument, axis by axis.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "host/calibration/analysis/analysis.h"

namespace tagwrench::study {

// Linear regression of a reference on features, standardised, with an optional ridge.

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
  Eigen::MatrixXd matrix() const;  ///< q x p: y = matrix() * features + constant()
  Eigen::VectorXd constant() const;
};

/// Least squares with the penalty ridge * n * |weights|^2 on standardised features. Combinations of
/// features that never changed get no weight. Needs two rows at least.
LinearModel fit_linear(const Eigen::MatrixXd& features, const Eigen::MatrixXd& values,
                       double ridge);

/// 1 - squares of the errors / squares about the mean, per column; NaN where nothing changed.
Eigen::VectorXd r_squared(const Eigen::MatrixXd& predicted, const Eigen::MatrixXd& truth);

/// Root mean square of the errors, per column.
Eigen::VectorXd rms_error(const Eigen::MatrixXd& predicted, const Eigen::MatrixXd& truth);

/// With a load whose standard deviation is less than ten times what the reference itself wavers,
/// more than a tenth of what is compared is the reference's own error: nothing better could be
/// shown.
inline constexpr double kMinExcitation = 10;

/// Range, excitation and independence of each axis: fills AxisReport's range_*, full_scale,
/// reference_noise, excitation, independent, calibrated and reason, and Analysis' weakest*.
/// `felt`: k x 6, of all readings.
void judge_excitation(const Eigen::MatrixXd& felt, const Eigen::VectorXd& noise,
                      Analysis& analysis);

/// From Analysis' held-out series and ranges: scores, non-linearity, hysteresis (NaN where the data
/// are too few), coverage and cross_talk.
void measure_held_out(Analysis& analysis);

/// All readings, by the fit to all of them.
struct Course {
  Eigen::VectorXd time;       ///< k
  Eigen::MatrixXd predicted;  ///< k x 6
  Eigen::MatrixXd felt;       ///< k x 6
  Eigen::VectorXi segment;    ///< k: rows of one number follow each other without a gap
};

/// Noise, drift and creep where the load stands still; `one_clock`: times of all segments go on.
void measure_rest(const Course& course, double period, bool one_clock, Analysis& analysis);

}  // namespace tagwrench::study
