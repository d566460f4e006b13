// Room calibration/analysis: how well readings predict a reference, on data held out.
// In:  trials: times (s), features (m, rad), loads (N, N m); of calibrations, recordings, CSV.
// Out: per axis R^2, RMSE (N, N m), lag (s), cross-talk, and why an axis is not calibrated.
// Then: trial_csv.h, lag.h, analysis_steps.h.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <limits>
#include <string>
#include <vector>

#include "host/calibration/analysis/lag.h"
#include "host/calibration/analysis/trial_csv.h"
#include "host/core/axis_names.h"
#include "host/core/types.h"

namespace tagwrench::study {

inline constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
inline constexpr std::array<const char*, 6> kAxisUnits{"N", "N", "N", "N m", "N m", "N m"};

struct AnalysisOptions {
  int folds = 5;           ///< blocks in time
  double hold_out = 0;     ///< share at the end that is held out instead of blocks; 0: blocks
  double guard = 0;        ///< s on both sides of what is held out that are not learned from
  double ridge = 0;        ///< of standardised features
  bool smooth = false;     ///< all features by [1/4 1/2 1/4], the reference by the same triangle
  double drop_start = 0;   ///< s of readings left out at the start
  double lag_from = -0.2;  ///< s, searched
  double lag_to = 0.5;
  bool drop_backlog = true;  ///< rows at the start stamped far faster than the rest
};

struct AxisReport {
  bool calibrated = true;
  std::string reason;                    ///< why it is not
  double range_low = 0, range_high = 0;  ///< N or N m, of the reference
  double full_scale = 0;                 ///< the larger of the two, by magnitude
  double r2_in_sample = 0;
  double r2 = 0;            ///< held out
  double rmse = 0;          ///< held out, N or N m
  double rmse_percent = 0;  ///< of full scale
  // NaN where the data are too few.
  double nonlinearity_percent = 0;  ///< largest deviation of the binned held-out mean from the line
  double hysteresis_percent = 0;    ///< largest gap between rising and falling binned means
  double noise = kNaN;              ///< at rest, standard deviation, N or N m
  double noise_density = kNaN;      ///< per root Hz
  double resolution = kNaN;         ///< smallest step told from noise at 95 %
  double drift_per_hour = kNaN;     ///< of the rest
  double creep_percent = kNaN;      ///< over a hold, of the load
  double coverage = kNaN;           ///< share of held-out errors within 95 % intervals
  double reference_noise = 0;       ///< of the reference itself, standard deviation, N or N m
  double reference_step = 0;        ///< it counts in, N or N m; 0: fine
  double excitation = 0;            ///< standard deviation of the reference over its noise or step
  double independent = 0;           ///< the same of the part that the other axes' loads do not tell
};

struct Fold {
  std::size_t trial = 0;
  double from = 0, to = 0;  ///< s, held out
  Lag lag;                  ///< found without it
  bool lag_sought = false;  ///< false: it learned from loads that hung, or was told not to
  std::array<double, 6> r2{}, rmse{};  ///< R^2 is NaN where the load changed no
                                       ///< more than the reference's own noise
};

struct Analysis {
  std::vector<std::string> names;  ///< of the trials
  std::vector<std::string> feature_names;
  std::size_t readings = 0, references = 0;  ///< used
  double seconds = 0;
  double reading_rate = 0, reference_rate = 0;  ///< Hz; reference 0 where loads hung
  std::string validation;                       ///< what was held out, for people
  bool own_predictions = false;  ///< scores are of the predictions that the trials brought
  Lag lag;                       ///< of all
  std::array<AxisReport, 6> axis;
  Eigen::MatrixXd matrix;  ///< 6 x p: reference = matrix * features + offset, of all data
  Eigen::VectorXd offset;  ///< 6
  /// Row: axis that errs; column: axis that is loaded; % of full scale at full load. Diagonal:
  /// error of gain. NaN where loads went together too much to tell.
  Matrix6 cross_talk = Matrix6::Zero();
  double condition = 0;      ///< of the standardised features
  std::string weakest;       ///< the combination of axes that was excited least
  double weakest_share = 0;  ///< of its variance in what it would be if axes were independent
  std::vector<Fold> folds;
  std::vector<std::string> warnings;
  /// Held out, at the times of the readings that were used, for the plots.
  Eigen::VectorXd time;             ///< k, s
  Eigen::MatrixXd predicted;        ///< k x 6
  Eigen::MatrixXd predicted_sigma;  ///< k x 6
  Eigen::MatrixXd felt;             ///< k x 6, the reference there
  Eigen::VectorXi segment;          ///< k: rows of one number follow each other without a gap
};

/// Throws ConfigError: fewer readings than unknowns, times that do not grow, no overlap in time,
/// trials whose features differ.
Analysis analyze(const std::vector<Trial>& trials, const AnalysisOptions& options);

/// With a load whose standard deviation is less than ten times what the reference itself wavers,
/// more than a tenth of what is compared is the reference's own error: nothing better could be
/// shown.
inline constexpr double kMinExcitation = 10;

/// Lines about axes without figures of their own, one for all axes of one reason. Where the trials
/// brought predictions, figures there are, and the line says what the data alone would not show.
std::vector<std::string> excitation_warnings(const Analysis& analysis);

/// Of intervals that hold far fewer errors than they say; empty if none.
std::vector<std::string> coverage_warnings(const Analysis& analysis);

// An Analysis for people and for programs.

/// A page of text, lines of at most 100 characters but for warnings.
std::string analysis_text(const Analysis& analysis);

/// One JSON object, format "tagwrench-analysis-1": SI units, numbers that are not known null. The
/// held-out series is in it only if asked for.
std::string analysis_json(const Analysis& analysis, bool with_series);

}  // namespace tagwrench::study
