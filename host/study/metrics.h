// What held-out predictions say about an instrument, axis by axis.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "host/study/analysis.h"

namespace tagwrench::study {

/// Range, excitation and independence of each axis: fills AxisReport's range_*, full_scale,
/// reference_noise, excitation, independent, calibrated and reason, and Analysis' weakest*.
/// `felt`: k x 6, of all readings.
void judge_excitation(const Eigen::MatrixXd& felt, const Eigen::VectorXd& noise,
                      Analysis& analysis);

/// From Analysis' held-out series and ranges: the scores and characteristics of AxisReport, and
/// cross_talk.
void measure_axes(Analysis& analysis, double period, bool one_clock);

/// Windows in which the load stands still, as rows of the held-out series: first and count.
struct Window {
  Eigen::Index first = 0;
  Eigen::Index count = 0;
};
std::vector<Window> quiet_windows(const Analysis& analysis, double period);

}  // namespace tagwrench::study
