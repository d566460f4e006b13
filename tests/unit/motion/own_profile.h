// Profiles as a sensor makes them from text.
#pragma once

#include <string>

#include "host/motion/profile_config.h"
#include "host/sensor/sensor_config.h"
#include "host/source/simulator/simulator_source.h"

namespace tagwrench::test {

inline Profile defaults() {
  static const Profile made =
      default_profile(parse_sensor(sim::sensor_yaml(sim::Scenario{}), "the simulated sensor"));
  return made;
}

inline Profile profile_of(const std::string& text) {
  return parse_profile(text, "mine.yaml", defaults());
}

}  // namespace tagwrench::test
