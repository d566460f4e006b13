// What was recorded -> observations for the fit, and the same as a trial for analysis and
// certificate.
#pragma once

#include <vector>

#include "host/calibration/analysis/lag.h"
#include "host/calibration/analysis/trial_csv.h"
#include "host/calibration/wrench/plan.h"
#include "host/calibration/wrench/record.h"
#include "host/wrench/fit.h"

namespace tagwrench {

struct WrenchData {
  std::vector<Observation> observations;
  std::vector<PathPoint> path;  ///< of the platform, where it was looked at
  study::Trial trial;
  study::Lag lag;  ///< of the camera behind the reference; not known of masses, which have none
  int zero_in_use = 0;  ///< of the first mounting, in which the sensor is used
};

/// Rests and masses give one observation each, the mean over the hold; pushes one a second, frames
/// and what the reference said `lag` before them averaged alike; movements one for each frame (of
/// long ones, for as many as are useful).
/// What displacement and reference drift between two rests is taken out, linearly in time.
/// `cell_gain_sigma`: relative, of the load cell's calibration. Throws ConfigError if nothing was
/// recorded but rests, or a reference and the platform have nothing to do with each other at any
/// lag.
WrenchData collect(const WrenchPlan& plan, const std::vector<StepRecord>& records,
                   double cell_gain_sigma);

/// Fills `predicted` of the data's trial: what the fit, without the step in question, says of each
/// reading. The readings of a hold share its prediction and differ by their own displacement; of a
/// push or a movement those frames have one that were observations or in the middle of one.
void add_predictions(const WrenchPlan& plan, const WrenchFit& fit, WrenchData& data);

}  // namespace tagwrench
