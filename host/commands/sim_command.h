// `tagwrench sim`: pictures of the simulated sensor, in a folder.
#pragma once

#include <string>

#include "host/core/command_line/command_line.h"

namespace tagwrench {

/// Declares itself on the command line; must outlive the parsing.
class SimCommand {
 public:
  explicit SimCommand(command_line::Command program);

  bool parsed() const { return verb_.parsed(); }
  /// Returns the exit status. Throws ConfigError for a scenario or folder that cannot be used.
  int run() const;

 private:
  command_line::Command verb_;
  std::string scenario_;
  std::string folder_;
  int frames_ = 0;
};

}  // namespace tagwrench
