// `tagwrench tune`: sliders for the profile of a sensor that runs, felt at once.
#pragma once

#include <string>

#include "host/command_line/command_line.h"

namespace tagwrench {

/// Declares itself on the command line; must outlive the parsing.
class TuneCommand {
 public:
  explicit TuneCommand(command_line::Command program);

  bool parsed() const { return verb_.parsed(); }
  /// Returns the exit status. Throws ConfigError: no sensor runs, it has no such profile, or there
  /// is no terminal.
  int run() const;

 private:
  command_line::Command verb_;
  std::string profile_;
  std::string name_ = "sensor";
  std::string out_;
};

}  // namespace tagwrench
