// A hint as one line for people: what is seen, where, and what to do.
#pragma once

#include <string>

#include "host/core/types.h"

namespace tagwrench {

std::string hint_text(Hint hint, const HintDetails& details);

}  // namespace tagwrench
