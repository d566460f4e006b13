// What setup throws: one line that names what, where and the remedy. main() prints it and exits
// with 2.
#pragma once

#include <stdexcept>

namespace tagwrench {

class ConfigError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

}  // namespace tagwrench
