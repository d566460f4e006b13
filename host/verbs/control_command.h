// `tagwrench control`: a wish to a sensor that runs.
#pragma once

#include <CLI/CLI.hpp>
#include <string>

namespace tagwrench {

/// Declares itself on the command line; must outlive the parsing.
class ControlCommand {
 public:
  explicit ControlCommand(CLI::App& app);

  bool parsed() const { return verb_->parsed(); }
  /// 0: done; 1: the sensor refuses. Throws ConfigError if none runs.
  int run() const;

 private:
  CLI::App* verb_;
  CLI::App* zero_;
  CLI::App* next_;
  CLI::App* profile_;
  CLI::App* window_;
  std::string name_ = "sensor";
  std::string profile_name_;
  std::string program_;
};

}  // namespace tagwrench
