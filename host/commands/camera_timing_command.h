// `tagwrench camera-timing`: its options, and from them a camera, a lamp and a report.
#pragma once

#include <functional>
#include <string>

#include "host/core/command_line/command_line.h"
#include "host/core/os/unique_fd.h"
#include "host/tools/camera_timing/screen_measurement.h"

namespace tagwrench {

/// Declares itself on the command line; must outlive the parsing.
class CameraTimingCommand {
 public:
  explicit CameraTimingCommand(command_line::Command program);

  bool parsed() const { return verb_.parsed(); }
  /// Measures and reports; returns the exit status. Throws ConfigError.
  int run() const;

 private:
  int run_with_screen() const;
  int measure(FrameSource& source, FlipPatch& patch, const UniqueFd& stop,
              const std::function<std::string()>& screen) const;
  void check_screen() const;
  int run_with_lamp() const;
  void print(const std::string& text, const std::string& json) const;

  command_line::Command verb_;
  std::string source_;
  std::string port_;
  std::string sensor_;
  std::string json_;
  double seconds_ = 10;
  command_line::Option screen_option_;
  std::string screen_;     ///< empty: a window
  std::string web_token_;  ///< file
  bool fast_ = false;
};

}  // namespace tagwrench
