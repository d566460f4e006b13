// `tagwrench bandwidth`: its options, and from them a camera, a lamp and a report.
#pragma once

#include <CLI/CLI.hpp>
#include <string>

namespace tagwrench {

/// Declares itself on the command line; must outlive the parsing.
class BandwidthCommand {
 public:
  explicit BandwidthCommand(CLI::App& app);

  bool parsed() const { return verb_->parsed(); }
  /// Measures and reports; returns the exit status. Throws ConfigError.
  int run() const;

 private:
  int run_with_screen() const;
  int run_with_lamp() const;
  void print(const std::string& text, const std::string& json) const;

  CLI::App* verb_;
  std::string source_;
  std::string port_;
  std::string sensor_;
  std::string json_;
  double seconds_ = 10;
  bool screen_ = false;
  bool fast_ = false;
};

}  // namespace tagwrench
