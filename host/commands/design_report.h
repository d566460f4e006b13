// A design -> what `tagwrench design` prints.
#pragma once

#include <string>

#include "host/tools/design/design.h"

namespace tagwrench {

std::string design_report(const study::Instrument& instrument, const study::Design& design);

}  // namespace tagwrench
