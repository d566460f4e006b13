// The plan for one kitchen weight, with the points of a sensor to be built.
#pragma once

#include <string>

#include "host/tools/design/parameters.h"

namespace tagwrench {

/// The ready-made plan six_orientations as text, its four points and its weight those of this
/// sensor; its comments stay.
std::string hardware_plan(const hardware::Parameters& parameters);

}  // namespace tagwrench
