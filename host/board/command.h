// `tagwrench board`: its options, and the verbs below it.
#pragma once

#include <CLI/CLI.hpp>

#include "host/board/options.h"

namespace tagwrench {

/// Declares itself on the command line; must outlive the parsing.
class BoardCommand {
 public:
  explicit BoardCommand(CLI::App& app);

  bool parsed() const { return verb_->parsed(); }
  /// Returns the exit status. Throws ConfigError for a port or a setting that cannot be used.
  int run() const;

 private:
  CLI::App* add(const char* name, const char* what);
  void add_samples(CLI::App* verb);
  void add_cells_file(CLI::App* verb);
  void add_optoforce();
  void add_lines(CLI::App* verb, const char* json);
  void add_seconds(CLI::App* verb);

  CLI::App* verb_;
  CLI::App* info_;
  CLI::App* watch_;
  CLI::App* led_;
  CLI::App* tare_;
  CLI::App* calibrate_cell_;
  CLI::App* flash_;
  CLI::App* log_;
  CLI::App* optoforce_;
  BoardOptions options_;
};

}  // namespace tagwrench
