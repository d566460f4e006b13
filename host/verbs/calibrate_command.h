// `tagwrench calibrate`: the verb, its sub-commands and their options.
#pragma once

#include <CLI/CLI.hpp>

#include "host/verbs/calibrate_camera_command.h"
#include "host/verbs/calibrate_target_command.h"
#include "host/verbs/calibrate_wrench_command.h"

namespace tagwrench {

/// Declares itself on the command line; must outlive the parsing.
class CalibrateCommand {
 public:
  explicit CalibrateCommand(CLI::App& app);

  bool parsed() const { return verb_->parsed(); }
  /// Runs the sub-command that was given; returns the exit status. Throws ConfigError if it cannot
  /// start or refuses what it was shown.
  int run() const;

 private:
  void declare_wrench();

  CLI::App* verb_;
  CLI::App* camera_;
  CLI::App* target_;
  CLI::App* wrench_;
  CalibrateCameraOptions camera_options_;
  CalibrateTargetOptions target_options_;
  CalibrateWrenchOptions wrench_options_;
  RecordOptions record_;
  std::string keep_ = "raw";  ///< of that
};

}  // namespace tagwrench
