// What a check in place has found, in words: one line, with what to do.
#pragma once

#include <string>

#include "host/calibration/check/in_situ.h"

namespace tagwrench {

/// "fine   light     white at 190 of 255, as at rest"
std::string text(const InSituFinding& finding);

}  // namespace tagwrench
