// What setup throws: one line that names what, where and the remedy. main() prints it and exits
// with 2.
#pragma once

#include <fmt/format.h>

#include <stdexcept>
#include <utility>

namespace tagwrench {

class ConfigError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
  template <typename First, typename... Rest>
  ConfigError(fmt::format_string<First, Rest...> text, First&& first, Rest&&... rest)
      : runtime_error(fmt::format(text, std::forward<First>(first), std::forward<Rest>(rest)...)) {}
};

/// What is to be read is damaged; main() exits with 1.
class DamagedFile : public ConfigError {
 public:
  using ConfigError::ConfigError;
};

}  // namespace tagwrench
