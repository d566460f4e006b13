// `tagwrench zero`: what the sensor reads with hands off becomes its zero, in
// measured/zero.yaml.
#pragma once

#include <string>

#include "host/core/command_line/command_line.h"

namespace tagwrench {

struct ZeroCommandOptions {
  std::string sensor;  ///< path
  std::string source;  ///< SRC
  int events = -1;     ///< descriptor, see Events
};

/// Declares itself on the command line; must outlive the parsing.
class ZeroCommand {
 public:
  explicit ZeroCommand(command_line::Command program);

  bool parsed() const { return verb_.parsed(); }
  /// 0: written; 1: refused, nothing was written. Throws ConfigError if it cannot start.
  int run() const;

 private:
  command_line::Command verb_;
  ZeroCommandOptions options_;
};

}  // namespace tagwrench
