// What an output may show of a sample: one rule for all of them.
#pragma once

#include "host/core/types.h"

namespace tagwrench {

/// The sample's status, but `doubtful` where a number that it would carry is not finite: an output
/// never passes on a NaN and never makes up a number in its place.
inline Status shown_status(const Sample& sample) {
  if (!carries_numbers(sample.status)) return sample.status;
  const bool finite = sample.displacement.allFinite() && sample.displacement_sigma.allFinite() &&
                      sample.wrench.allFinite() && sample.wrench_sigma.allFinite() &&
                      sample.deflection.allFinite();
  return finite ? sample.status : Status::doubtful;
}

}  // namespace tagwrench
