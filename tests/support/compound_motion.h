// A smooth motion along all six axes at once, for renderers that have no mechanics of their own.
#pragma once

#include <algorithm>
#include <cmath>
#include <numbers>

#include "host/core/types.h"

namespace tagwrench::test {

/// Displacement `time` seconds after the motion began: for each axis a sum of three tones below
/// about 1 Hz with frequencies that no two axes share, never beyond `amplitude` (m, rad), zero at
/// the start and with a soft beginning.
inline Vector6 compound_motion(const Vector6& amplitude, double time) {
  const double share = std::clamp(time, 0.0, 1.0);
  const double fade = share * share * (3 - 2 * share);
  Vector6 displacement;
  for (int axis = 0; axis < 6; ++axis) {
    const double slow = 0.17 + 0.023 * axis;  // Hz
    double sum = 0;
    for (int tone = 0; tone < 3; ++tone) {
      const double turns = slow * (1 + 1.37 * tone) * time + 0.19 * axis + 0.41 * tone;
      sum += std::sin(2 * std::numbers::pi * turns) / (1 + 0.5 * tone);
    }
    displacement[axis] = fade * amplitude[axis] * sum / 2.1667;
  }
  return displacement;
}

}  // namespace tagwrench::test
