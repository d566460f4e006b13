#include "host/calibration/wrench/record.h"

namespace tagwrench {

RecordMean mean_of(const StepRecord& record) {
  RecordMean mean;
  if (record.frames.empty()) return mean;
  HoldDetector hold({.seconds = 2 * (record.frames.back().time - record.frames.front().time) + 1});
  for (const TrackedFrame& frame : record.frames) hold.add(frame);
  const Hold all = hold.look();
  return {0.5 * (all.from + all.to), all.mean, all.covariance};
}

Vector6 mean_reading(const StepRecord& record) {
  Vector6 mean = Vector6::Zero();
  for (const ReferenceSample& sample : record.readings)
    mean += sample.value / static_cast<double>(record.readings.size());
  return mean;
}

}  // namespace tagwrench
