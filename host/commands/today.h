// The date that results carry.
#pragma once

#include <fmt/chrono.h>

#include <ctime>
#include <string>

namespace tagwrench {

/// YYYY-MM-DD, here.
inline std::string today() {
  return fmt::format("{:%Y-%m-%d}", fmt::localtime(std::time(nullptr)));
}

}  // namespace tagwrench
