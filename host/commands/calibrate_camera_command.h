// `tagwrench calibrate camera`: pictures of a board in, measured/camera.yaml beside a
// sensor.yaml out.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "host/calibration/camera/limits.h"

namespace tagwrench {

struct CalibrateCameraOptions {
  std::string source;                ///< SRC: a camera or a folder
  std::vector<std::string> folders;  ///< or folders, when source is empty
  std::string board;                 ///< board_spec.h
  std::string sensor;                ///< path; empty: the paper's sensor, and `out` is needed
  std::string out;                   ///< path of a new sensor.yaml; empty: `sensor`
  std::optional<int> views;
  std::optional<double> seconds;
  int events = -1;  ///< descriptor, see Events
};

/// Returns the exit status. Throws ConfigError if it cannot start, or if the views are too poor;
/// then nothing has been written.
int calibrate_camera(const CalibrateCameraOptions& options);

}  // namespace tagwrench
