// The sensor as its owner has it after `tagwrench calibrate target`.
#pragma once

#include "host/sensor/sensor_config.h"
#include "host/source/simulator/scenario.h"

namespace tagwrench::bench {

/// `sensor` with the places of the tags, the rest pose and the picture at rest that are found from
/// another recording of the same rig: other motion, other noise. Throws ConfigError, as the command
/// does, for a recording that cannot tell.
SensorConfig calibrated(const SensorConfig& sensor, const sim::Scenario& scenario);

}  // namespace tagwrench::bench
