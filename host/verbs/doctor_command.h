// `tagwrench doctor`: its options.
#pragma once

#include <CLI/CLI.hpp>

#include "host/verbs/focus.h"

namespace tagwrench {

/// Declares itself on the command line; must outlive the parsing.
class DoctorCommand {
 public:
  DoctorCommand(CLI::App& app, const CLI::Validator& duration);

  bool parsed() const { return verb_->parsed(); }
  /// Prints what it finds; returns the exit status. Throws ConfigError for a source or sensor that
  /// cannot be used.
  int run() const;

 private:
  CLI::App* verb_;
  bool focus_ = false;
  FocusOptions focusing_;
};

}  // namespace tagwrench
