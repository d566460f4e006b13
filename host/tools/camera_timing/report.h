// What `tagwrench camera-timing` says: for people, and as JSON.
#pragma once

#include <string>

#include "host/tools/camera_timing/measurement.h"

namespace tagwrench {

struct CameraTimingSetting {
  std::string camera;           ///< one line about the source
  std::string lamp;             ///< one line about the lamp
  std::string output;           ///< where processed frames went: "wrench sensor"
  double announced_period = 0;  ///< s
};

/// Some twenty lines.
std::string report_text(const CameraTimingMeasurement& measurement,
                        const CameraTimingSetting& setting);

/// One object; figures that the pictures cannot tell are null.
std::string report_json(const CameraTimingMeasurement& measurement,
                        const CameraTimingSetting& setting);

}  // namespace tagwrench
