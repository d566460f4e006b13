// What a calibration recorded, step by step: enough to fit anew, to show, and to go on from.
#pragma once

#include <vector>

#include "host/calibration/wrench/hold.h"
#include "host/core/types.h"

namespace tagwrench {

/// What the reference said at a time of its own.
struct ReferenceSample {
  double time = 0;  ///< s, on the frames' clock
  Vector6 value =
      Vector6::Zero();  ///< a load cell: the first alone, N; six axes: N and N m, as read
  Vector6 sigma = Vector6::Zero();  ///< one standard deviation
  bool saturated = false;
};

struct StepRecord {
  int step = 0;  ///< of the plan
  int zero = 0;  ///< records with one number count from one rest
  std::vector<TrackedFrame> frames;
  std::vector<ReferenceSample> readings;
};

/// Mean of a record's frames, by the hold detector's rules.
struct RecordMean {
  double time = 0;  ///< s
  Vector6 displacement = Vector6::Zero();
  Matrix6 covariance = Matrix6::Zero();
};
RecordMean mean_of(const StepRecord& record);

/// Mean of what the reference said, axis by axis; zero if it said nothing.
Vector6 mean_reading(const StepRecord& record);

}  // namespace tagwrench
