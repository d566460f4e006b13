#include "host/sensor/default_profile.h"

#include "host/wrench/estimate.h"
#include "host/wrench/zero.h"

namespace tagwrench {

Profile default_profile(const SensorConfig& sensor) {
  const Vector6 range = range_through(WrenchEstimator(sensor.wrench).tool(), sensor.wrench.range);
  Profile profile;
  profile.name = "default";
  profile.shaping = sensor.shaping;
  profile.gestures = gestures_for(range, sensor.shaping.hid_R_camera);
  return profile;
}

}  // namespace tagwrench
