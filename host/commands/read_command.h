// `tagwrench read`: what 6-DOF and wrench HID devices say, ours and others.
#pragma once

#include <optional>

#include "host/core/command_line/command_line.h"
#include "host/tools/reading/reader.h"

namespace tagwrench {

/// Declares itself on the command line; must outlive the parsing.
class ReadCommand {
 public:
  explicit ReadCommand(command_line::Command program);

  bool parsed() const { return verb_.parsed(); }
  /// Returns the exit status. Throws ConfigError if the device cannot be read.
  int run();

 private:
  command_line::Command verb_;
  ReadOptions options_;
  std::optional<double> seconds_;
  bool list_ = false;
  bool json_ = false;
  bool csv_ = false;
};

}  // namespace tagwrench
