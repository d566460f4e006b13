// What a calibration is worth on data that it has not seen: blocks in time, whole steps, or whole
// trials are held out, never random points, whose neighbours would give them away. The lag is found
// without the data held out, as everything else is.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <string>
#include <vector>

#include "host/calibration/analysis/analysis.h"
#include "host/calibration/analysis/metrics.h"

namespace tagwrench::study {

/// A trial that has been checked, its reference filtered as its readings will be.
struct CleanTrial {
  Eigen::VectorXd time;       ///< n
  Eigen::MatrixXd features;   ///< n x p, not yet smoothed
  Eigen::VectorXi step;       ///< n, or empty
  Eigen::MatrixXd predicted;  ///< n x 6, of the trial itself, and their sigmas; or empty
  Eigen::MatrixXd predicted_sigma;
  Eigen::VectorXd reference_time;
  Eigen::MatrixXd reference;
  Eigen::VectorXd noise;    ///< 6, standard deviation of the reference before it was filtered
  Eigen::VectorXd quantum;  ///< 6, step that it counts in, or 0
  double longest_gap = 0;   ///< s, that the reference is interpolated across
  bool held = false;
};

/// Readings that follow each other, of one trial.
struct Range {
  std::size_t trial = 0;
  Eigen::Index first = 0;
  Eigen::Index count = 0;
};

struct FoldPlan {
  std::vector<Range> held_out;
  std::vector<Range> learned;
};

struct FoldPlans {
  std::vector<FoldPlan> folds;
  std::string description;
};

/// All readings that count: those of steps, where there are steps.
std::vector<Range> usable_ranges(const std::vector<CleanTrial>& trials);

/// Several trials: each is held out once. One with steps: each step. Else blocks in time, or the
/// end.
FoldPlans plan_folds(const std::vector<CleanTrial>& trials, const AnalysisOptions& options);

/// Readings of some ranges and what the reference felt then.
struct Rows {
  Eigen::VectorXd time;              ///< k
  Eigen::MatrixXd features;          ///< k x p
  Eigen::MatrixXd felt;              ///< k x 6
  Eigen::VectorXi segment;           ///< k: index of the range
  Eigen::MatrixXd predicted, sigma;  ///< k x 6, that the trials brought; NaN where none
};

/// How readings are smoothed.
enum class Smoothing : std::uint8_t {
  none,
  apart,       ///< each range by itself: nothing outside of it gets in
  in_context,  ///< with the reading before and after the range, as an instrument does that runs
};

/// Those with a reference at that lag.
Rows rows_of(const std::vector<CleanTrial>& trials, const std::vector<Range>& ranges, double lag,
             Smoothing smoothing);

/// One lag for all; that of what hangs there is 0, and known.
Lag lag_of(const std::vector<CleanTrial>& trials, const std::vector<Range>& ranges,
           const AnalysisOptions& options);

struct HeldOut {
  std::vector<Fold> folds;  ///< empty where the trials brought their predictions
  Eigen::VectorXd time;
  Eigen::MatrixXd predicted, sigma, felt;
  Eigen::VectorXi segment;
};

/// What the trials brought; only where all of them did.
bool brings_predictions(const std::vector<CleanTrial>& trials);
HeldOut brought_predictions(const Rows& rows);

/// Throws ConfigError if a fold leaves too little to learn from.
HeldOut cross_validate(const std::vector<CleanTrial>& trials, const FoldPlans& plans,
                       const AnalysisOptions& options);

}  // namespace tagwrench::study
