// `tagwrench calibrate`: the verb, its sub-commands and their options.
#pragma once

#include "host/commands/calibrate_camera_command.h"
#include "host/commands/calibrate_target_command.h"
#include "host/commands/calibrate_wrench_command.h"
#include "host/core/command_line/command_line.h"

namespace tagwrench {

/// Declares itself on the command line; must outlive the parsing.
class CalibrateCommand {
 public:
  explicit CalibrateCommand(command_line::Command program);

  bool parsed() const { return verb_.parsed(); }
  /// Runs the sub-command that was given; returns the exit status. Throws ConfigError if it cannot
  /// start or refuses what it was shown.
  int run() const;

 private:
  void declare_wrench();

  command_line::Command verb_;
  command_line::Command camera_;
  command_line::Command target_;
  command_line::Command wrench_;
  CalibrateCameraOptions camera_options_;
  CalibrateTargetOptions target_options_;
  CalibrateWrenchOptions wrench_options_;
  RecordOptions record_;
  std::string keep_ = "raw";  ///< of that
};

}  // namespace tagwrench
