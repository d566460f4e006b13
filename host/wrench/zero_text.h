// What became of a zero on demand, in words.
#pragma once

#include <string_view>

#include "host/wrench/zero.h"

namespace tagwrench {

/// Empty for none.
std::string_view zero_text(ZeroAnswer answer) noexcept;

}  // namespace tagwrench
