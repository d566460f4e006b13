// A diagnostic as one line for people: what is seen, where, and what to do.
#pragma once

#include <string>

#include "host/core/types.h"

namespace tagwrench {

std::string diagnostic_text(Diagnostic diagnostic, const DiagnosticDetails& details);

}  // namespace tagwrench
