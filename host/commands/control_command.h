// `tagwrench control`: a request to a sensor that runs.
#pragma once

#include <string>

#include "host/core/command_line/command_line.h"

namespace tagwrench {

/// Declares itself on the command line; must outlive the parsing.
class ControlCommand {
 public:
  explicit ControlCommand(command_line::Command program);

  bool parsed() const { return verb_.parsed(); }
  /// 0: done; 1: the sensor refuses. Throws ConfigError if none runs.
  int run() const;

 private:
  command_line::Command verb_;
  command_line::Command zero_;
  command_line::Command next_;
  command_line::Command profile_;
  command_line::Command window_;
  std::string name_ = "sensor";
  std::string profile_name_;
  std::string program_;
};

}  // namespace tagwrench
