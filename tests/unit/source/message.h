// The one line that a refused set-up gives; empty where nothing was thrown.
#pragma once

#include <string>

#include "host/core/config_error.h"

namespace tagwrench {

template <typename Setup>
std::string refusal(Setup setup) {
  try {
    setup();
  } catch (const ConfigError& error) {
    return error.what();
  }
  return {};
}

/// One line, and it names all of these.
inline bool names(const std::string& message, std::initializer_list<const char*> parts) {
  if (message.empty() || message.find('\n') != std::string::npos) return false;
  for (const char* part : parts) {
    if (message.find(part) == std::string::npos) return false;
  }
  return true;
}

}  // namespace tagwrench
