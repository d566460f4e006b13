// What the package and the shells ask of the program: `tagwrench manual` writes its man pages,
// `tagwrench complete` says what may be typed next. Not for people, so no help names them.
#pragma once

#include <string>
#include <vector>

#include "host/core/command_line/command_line.h"

namespace tagwrench {

/// Declares itself on the command line; must outlive the parsing.
class ManualCommand {
 public:
  explicit ManualCommand(command_line::Command program);

  bool parsed() const { return manual_.parsed() || complete_.parsed(); }
  /// Returns the exit status. Throws ConfigError if the pages cannot be written.
  int run() const;

 private:
  void write_pages() const;
  void print_completion() const;

  command_line::Command program_;
  command_line::Command manual_;
  command_line::Command complete_;
  std::string folder_;
  std::vector<std::string> typed_;
};

}  // namespace tagwrench
