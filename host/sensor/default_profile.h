// The profile of a sensor for which nobody has chosen one.
#pragma once

#include "host/motion/profile_config.h"
#include "host/sensor/sensor_config.h"

namespace tagwrench {

/// What holds without a profile: the sensor's own shaping and mounting, gestures scaled to its
/// range, none of which does anything.
Profile default_profile(const SensorConfig& sensor);

}  // namespace tagwrench
