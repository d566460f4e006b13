// `tagwrench record`: a run that is recorded.
#pragma once

#include <CLI/CLI.hpp>
#include <string>

#include "host/verbs/run_command.h"

namespace tagwrench {

/// Declares itself on the command line; must outlive the parsing.
class RecordCommand {
 public:
  /// `sources` and `outputs` explain --source and --output; `seconds` checks times.
  RecordCommand(CLI::App& app, const std::string& sources, const std::string& outputs,
                const CLI::Validator& seconds);

  bool parsed() const { return verb_->parsed(); }
  /// Returns the exit status. Throws ConfigError if it cannot start.
  int run();

 private:
  CLI::App* verb_;
  RunOptions options_;
  RecordOptions record_;
  std::string keep_ = "raw";
};

}  // namespace tagwrench
