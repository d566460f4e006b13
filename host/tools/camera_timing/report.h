// What `tagwrench bandwidth` says: for people, and as JSON.
#pragma once

#include <string>

#include "host/tools/camera_timing/measurement.h"

namespace tagwrench {

struct BandwidthSetting {
  std::string camera;           ///< one line about the source
  std::string lamp;             ///< one line about the lamp
  std::string output;           ///< where processed frames went: "wrench sensor"
  double announced_period = 0;  ///< s
};

/// Some twenty lines.
std::string report_text(const BandwidthMeasurement& measurement, const BandwidthSetting& setting);

/// One object; figures that the pictures cannot tell are null.
std::string report_json(const BandwidthMeasurement& measurement, const BandwidthSetting& setting);

}  // namespace tagwrench
