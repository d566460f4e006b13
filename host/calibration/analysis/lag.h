// How far readings lag behind a reference: one lag for all axes, since all axes come from the same
// frames and the same instrument.
//
// The best lag is the one at which a linear model of the readings leaves least of the reference:
// the smallest sum over axes of log(unexplained share of the variance), which is the likelihood of
// normal residuals with a variance per axis (D. R. Cox and D. V. Hinkley, Theoretical Statistics,
// 1974, 4.3), so that an axis that says little about time weighs little. Its uncertainty is the
// jackknife's over blocks in time, which needs no assumption about how residuals are correlated (H.
// R. Kuensch, Ann. Stat. 17, 1989).
#pragma once

#include <Eigen/Core>
#include <span>
#include <string>

namespace tagwrench::study {

/// A reading at time t belongs to the reference at time t - value: positive where readings come
/// late.
struct Lag {
  double value = 0;       ///< s
  double sigma = 0;       ///< s, one standard deviation
  double explained = 0;   ///< R^2 at this lag, mean over the axes that change
  bool known = false;     ///< false: the data do not tell, and value is 0
  bool at_limit = false;  ///< the best one lies at the end of what was searched
};

/// Readings and reference of one segment of time without a gap: a push, a whole recording.
struct Segment {
  Eigen::VectorXd time;            ///< n, s, growing
  Eigen::MatrixXd features;        ///< n x p
  Eigen::VectorXd reference_time;  ///< m, s, growing, same clock
  Eigen::MatrixXd reference;       ///< m x q. A load cell: q = 1 with a model per direction, or its
                                   ///< force times the line's wrench, q = 6
  int model = 0;  ///< segments of one number share the coefficients; offsets are always their own
};

struct LagSearch {
  double from = -0.2;  ///< s
  double to = 0.5;
  double ridge = 1e-6;  ///< of standardised features
  bool smooth = true;   ///< both, alike, for the search; false: they are already
};

/// Constant axes and features do not count. All segments have the same p and q. `known` is false
/// where fewer than about 3 p readings lie within the reference at every lag of the search, or
/// nothing changes.
Lag estimate_lag(std::span<const Segment> segments, const LagSearch& search = {});

/// "the readings come 41.2 +- 0.7 ms after the reference", or the other way round: whichever comes
/// first, the number is positive.
std::string lag_text(const Lag& lag);

/// One line that warns of it; empty if there is nothing to say. `from` to `to` is what is usual, s:
/// pictures and instruments alike may be slow by some tenths of a second.
std::string lag_warning(const Lag& lag, double from = -0.2, double to = 0.2);

/// The reference at `time` - lag, by linear interpolation: n x q. Rows before the first or after
/// the last reference, or between two that are more than `longest_gap` (s) apart, are NaN.
Eigen::MatrixXd reference_at(const Eigen::VectorXd& time, double lag,
                             const Eigen::VectorXd& reference_time,
                             const Eigen::MatrixXd& reference, double longest_gap);

// The same filter for readings and reference, so that they stay comparable.

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
