// `tagwrench check`: whether a calibrated sensor still measures what it did, found out where it
// stands.
#pragma once

#include <CLI/CLI.hpp>
#include <optional>
#include <string>
#include <vector>

namespace tagwrench {

struct CheckOptions {
  std::string sensor;            ///< path
  std::string source;            ///< SRC
  std::optional<double> mass_g;  ///< to be hung
  double mass_sigma_percent = 0.5;
  std::vector<double> at_mm;  ///< where a load takes hold, platform frame
  double at_sigma_mm = 0.3;
  std::vector<double> gravity{0, 0, -1};  ///< along which masses pull, camera axes
  double direction_sigma_deg = 1;         ///< of gravity
};

/// Declares itself on the command line; must outlive the parsing.
class CheckCommand {
 public:
  explicit CheckCommand(CLI::App& app);

  bool parsed() const { return verb_->parsed(); }
  /// 0: all is fine; 1: something is not, or could not be told. Throws ConfigError if it cannot
  /// start.
  int run() const;

 private:
  CLI::App* verb_;
  CheckOptions options_;
};

}  // namespace tagwrench
