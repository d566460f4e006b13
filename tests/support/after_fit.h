// What a calibrated force sensor has left of a tracker's error: a stiffness matrix takes up every
// affine error, noise and non-linearity remain.
#pragma once

#include <vector>

#include "host/core/types.h"

namespace tagwrench::test {

/// Fits an affine map (6 x 6 and offset) from readings to truth by least squares on the first half
/// of a moving sequence; the RMS error per axis that it leaves on the second half, m and rad. NaN
/// for fewer than 60 readings.
Vector6 error_after_fit(const std::vector<Vector6>& readings, const std::vector<Vector6>& truths);

}  // namespace tagwrench::test
