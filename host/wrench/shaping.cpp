#include "host/wrench/shaping.h"

#include <algorithm>
#include <cmath>

namespace tagwrench {

void Shaping::shape(Sample& sample) const noexcept {
  sample.motion.setZero();
  if (!carries_numbers(sample.status)) return;
  Vector6 hid;
  hid.head<3>() = options_.hid_R_camera * sample.wrench.head<3>();
  hid.tail<3>() = options_.hid_R_camera * sample.wrench.tail<3>();
  for (int i = 0; i < 6; ++i) {
    const double beyond = std::abs(hid[i]) - options_.dead_zone[i];
    if (beyond <= 0) continue;
    const double part = beyond / (options_.full_scale[i] - options_.dead_zone[i]);
    sample.motion[i] = std::copysign(std::min(part, 1.0), hid[i]);
  }
}

}  // namespace tagwrench
