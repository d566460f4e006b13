// scenario.yaml -> sim::Scenario. Defaults are those of scenario.h; an unknown key is an error.
#pragma once

#include <string>

#include "host/source/simulator/scenario.h"

namespace tagwrench {

/// A file of hardware/sensors is a scenario too: that sensor, as built. In others `hardware: FILE`
/// (seen from the scenario) puts that sensor in the place of the defaults.
/// Throws ConfigError with file, line and key.
sim::Scenario load_scenario(const std::string& path);
sim::Scenario parse_scenario(const std::string& text, const std::string& name);

}  // namespace tagwrench
