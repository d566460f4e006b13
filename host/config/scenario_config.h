// scenario.yaml -> sim::Scenario. Every key has the default of scenario.h; an unknown key is an
// error.
#pragma once

#include <string>

#include "host/source/simulator/scenario.h"

namespace tagwrench {

/// Throws ConfigError with file, line and key.
sim::Scenario load_scenario(const std::string& path);
sim::Scenario parse_scenario(const std::string& text, const std::string& name);

}  // namespace tagwrench
