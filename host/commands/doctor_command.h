// `tagwrench doctor`: its options.
#pragma once

#include "host/commands/focus.h"
#include "host/core/command_line/command_line.h"

namespace tagwrench {

/// Declares itself on the command line; must outlive the parsing.
class DoctorCommand {
 public:
  explicit DoctorCommand(command_line::Command program);

  bool parsed() const { return verb_.parsed(); }
  /// Prints what it finds; returns the exit status. Throws ConfigError for a source or sensor that
  /// cannot be used.
  int run() const;

 private:
  command_line::Command verb_;
  bool focus_ = false;
  FocusOptions focusing_;
};

}  // namespace tagwrench
