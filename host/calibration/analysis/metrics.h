// What held-out predictions say about an instrument, axis by axis.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "host/calibration/analysis/analysis.h"

namespace tagwrench::study {

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
