// sensor.yaml's zero -> the options of its following.
#pragma once

#include "host/sensor/sensor_config.h"
#include "host/wrench/zero.h"

namespace tagwrench {

/// `tool` is WrenchEstimator::tool() of this sensor; `may_follow`: false keeps the zero where it is
/// set.
inline ZeroOptions zero_options(const SensorConfig& sensor, const Matrix6& tool, bool may_follow) {
  ZeroOptions options;
  options.follow = may_follow && sensor.zero.follow;
  options.range = range_through(tool, sensor.wrench.range);
  options.set = tool * sensor.zero.set;
  options.band = sensor.zero.band;
  options.rate = sensor.zero.rate;
  return options;
}

}  // namespace tagwrench
