// Profiles as a sensor makes them from text.
#pragma once

#include <string>

#include "host/motion/profile_config.h"
#include "host/sensor/sensor_config.h"
#include "host/source/simulator/folder_export.h"

namespace tagwrench::test {

inline Profile defaults() {
  static const Profile made =
      default_profile(parse_sensor(sim::sensor_yaml(sim::Scenario{}), "the simulated sensor"));
  return made;
}

inline Profile profile_of(const std::string& text) {
  return parse_profile(text, "mine.yaml", defaults());
}

inline constexpr const char* kMine =
    "# what I like\n"
    "name: mine        # and its name\n"
    "axes:\n"
    "  x: {full_scale_n: 0.5}   # light\n"
    "  rx: {from: x, dead_zone_n: 0.01}\n"
    "dominant:\n"
    "  ratio: 1.5      # one at a time\n"
    "# the end\n";

}  // namespace tagwrench::test
