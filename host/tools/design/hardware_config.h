// hardware/sensors/NAME.yaml -> hardware::Parameters, and what a simulator makes of them. Every
// check of a single value is here; whether they go together, host/tools/design/checks.h says.
#pragma once

#include <string>

#include "host/source/simulator/scenario.h"
#include "host/tools/design/parameters.h"

namespace tagwrench {

/// The camera comes from ../cameras/NAME.yaml, seen from the file. Throws ConfigError with file,
/// line and key.
hardware::Parameters load_hardware(const std::string& path);

/// The same, and it can be built. Throws ConfigError naming the first parameter that is in the way.
hardware::Parameters load_buildable(const std::string& path);

/// Whether a file describes hardware, and not a scenario or a sensor: by its keys.
bool is_hardware(const std::string& path);

/// The simulated sensor, built without errors but for gluing; all its tags, as if there were no
/// mirror.
sim::Scenario scenario_of(const hardware::Parameters& parameters);

/// The same with those tags alone that the program follows: none in a mirror.
sim::Scenario runnable_scenario_of(const hardware::Parameters& parameters);

}  // namespace tagwrench
