// The same filter for readings and reference, so that they stay comparable.
#pragma once

#include <Eigen/Core>

namespace tagwrench::study {

/// Each row becomes 1/4, 1/2, 1/4 of the rows before, at and after it; the two ends stay.
Eigen::MatrixXd smooth_rows(const Eigen::MatrixXd& rows);

/// What [1/4 1/2 1/4] of readings `period` apart does, done to values at times of their own: the
/// triangle of half-width `period`, of the linear interpolation. Times and values beyond the ends
/// are not made up: the triangle is cut there.
Eigen::MatrixXd smooth_reference(const Eigen::VectorXd& time, const Eigen::MatrixXd& values,
                                 double period);

/// 0 for fewer than two times.
double median_interval(const Eigen::VectorXd& time);

}  // namespace tagwrench::study
