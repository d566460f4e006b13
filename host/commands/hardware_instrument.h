// What will be printed, as the instrument that `tagwrench design` looks at.
#pragma once

#include "host/tools/design/design.h"
#include "host/tools/design/parameters.h"

namespace tagwrench {

/// What `tagwrench design` looks at. Blur, noise, contrast and counts stay as they were.
void take_hardware(const hardware::Parameters& parameters, study::Instrument& instrument);

}  // namespace tagwrench
