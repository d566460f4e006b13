#include "host/motion/gestures.h"
#include "host/wrench/zero.h"

namespace tagwrench {

GestureOptions gestures_for(const Vector6& range, const Eigen::Matrix3d& hid_R_camera) {
  GestureOptions options;
  options.hid_R_camera = hid_R_camera;
  const Vector6 felt = range_along(hid_R_camera, range);
  for (int i = 0; i < 6; ++i) {
    if (felt[i] <= 0) continue;
    options.quiet[i] = 0.06 * felt[i];
    options.twist_others[i] = 0.3 * felt[i];
  }
  if (felt[2] > 0) {
    options.tap_force = 0.2 * felt[2];
    options.press_force = 0.4 * felt[2];
  }
  if (felt[5] > 0) options.twist_torque = felt[5] / 3;
  return options;
}

const GestureAction& Gestures::action(Gesture gesture) const noexcept {
  static constexpr GestureAction kNothing;
  switch (gesture) {
    case Gesture::none:
      break;
    case Gesture::tap:
      return options_.tap;
    case Gesture::double_tap:
      return options_.double_tap;
    case Gesture::press_hold:
      return options_.press_hold;
    case Gesture::twist_left:
      return options_.twist_left;
    case Gesture::twist_right:
      return options_.twist_right;
  }
  return kNothing;
}

}  // namespace tagwrench
