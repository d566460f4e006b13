#include "host/motion/shaping.h"
#include "host/wrench/zero.h"

namespace tagwrench {

ShapingOptions shaping_for(const Vector6& range, const Eigen::Matrix3d& hid_R_camera) {
  constexpr double kFullScale = 2.0 / 3;  // what is left is for the hand that pushes too hard
  ShapingOptions options;
  options.hid_R_camera = hid_R_camera;
  const Vector6 felt = range_along(hid_R_camera, range);
  for (int i = 0; i < 6; ++i) {
    if (felt[i] <= 0) continue;
    const double full_scale = kFullScale * felt[i];
    options.dead_zone[i] *= full_scale / options.full_scale[i];
    options.full_scale[i] = full_scale;
  }
  return options;
}

}  // namespace tagwrench
