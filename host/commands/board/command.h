// `tagwrench board`: its options, and the verbs below it.
#pragma once

#include "host/commands/board/options.h"
#include "host/core/command_line/command_line.h"

namespace tagwrench {

/// Declares itself on the command line; must outlive the parsing.
class BoardCommand {
 public:
  explicit BoardCommand(command_line::Command program);

  bool parsed() const { return verb_.parsed(); }
  /// Returns the exit status. Throws ConfigError for a port or a setting that cannot be used.
  int run() const;

 private:
  command_line::Command add(const char* name, const char* what);
  void add_samples(command_line::Command verb);
  void add_cells_file(command_line::Command verb);
  void add_optoforce();
  void add_lines(command_line::Command verb, const char* json);
  void add_seconds(command_line::Command verb);

  command_line::Command verb_;
  command_line::Command info_;
  command_line::Command watch_;
  command_line::Command led_;
  command_line::Command tare_;
  command_line::Command calibrate_cell_;
  command_line::Command flash_;
  command_line::Command log_;
  command_line::Command optoforce_;
  BoardOptions options_;
};

}  // namespace tagwrench
