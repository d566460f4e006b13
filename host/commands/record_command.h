// `tagwrench record`: a run that is recorded.
#pragma once

#include <string>

#include "host/commands/run_command.h"
#include "host/core/command_line/command_line.h"

namespace tagwrench {

/// Declares itself on the command line; must outlive the parsing.
class RecordCommand {
 public:
  explicit RecordCommand(command_line::Command program);

  bool parsed() const { return verb_.parsed(); }
  /// Returns the exit status. Throws ConfigError if it cannot start.
  int run();

 private:
  command_line::Command verb_;
  RunOptions options_;
  RecordOptions record_;
  std::string keep_ = "raw";
};

}  // namespace tagwrench
