// The sensors of hardware/sensors.
#pragma once

#include <string>

#include "host/tools/design/parameters.h"

namespace tagwrench::hardware {

inline Parameters published(const std::string& name) {
  return load_hardware(std::string(TAGWRENCH_SENSORS) + "/" + name + ".yaml");
}

}  // namespace tagwrench::hardware
