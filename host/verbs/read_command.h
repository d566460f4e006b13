// `tagwrench read`: what 6-DOF and wrench HID devices say, ours and others.
#pragma once

#include <CLI/CLI.hpp>
#include <optional>

#include "host/client/reader.h"

namespace tagwrench {

/// Declares itself on the command line; must outlive the parsing.
class ReadCommand {
 public:
  ReadCommand(CLI::App& app, const CLI::Validator& duration);

  bool parsed() const { return verb_->parsed(); }
  /// Returns the exit status. Throws ConfigError if the device cannot be read.
  int run();

 private:
  CLI::App* verb_;
  ReadOptions options_;
  std::optional<double> seconds_;
  bool list_ = false;
  bool json_ = false;
  bool csv_ = false;
};

}  // namespace tagwrench
