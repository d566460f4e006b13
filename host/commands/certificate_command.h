// `tagwrench certificate`: a calibration and the data it rests on, as one page.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "host/calibration/certificate/certificate.h"
#include "host/core/command_line/command_line.h"

namespace tagwrench {

/// Declares itself on the command line; must outlive the parsing.
class CertificateCommand {
 public:
  explicit CertificateCommand(command_line::Command program);

  bool parsed() const { return verb_.parsed(); }
  /// Writes the three files; returns the exit status. Throws ConfigError for what cannot be
  /// certified.
  int run() const;

 private:
  struct Subject;
  Subject subject() const;
  Certificate certificate() const;
  std::filesystem::path prefix() const;
  bool may_replace(const std::vector<std::filesystem::path>& files) const;

  command_line::Command verb_;
  std::filesystem::path out_;
  std::string sensor_;
  std::string calibration_;
  std::vector<std::filesystem::path> data_;
  std::string environment_;
  bool force_ = false;
};

}  // namespace tagwrench
