// What of measured/ is put over what sensor.yaml says, and whether it may be.
#pragma once

#include <filesystem>

#include "host/sensor/sensor_config.h"

namespace tagwrench {

/// The files of one sensor. All throw ConfigError that names the file, what does not fit and the
/// remedy.
struct Measured {
  std::filesystem::path sensor;  ///< path of sensor.yaml, or what stands for it
  std::filesystem::path folder;  ///< empty: nothing was measured
  WrenchCalibration use = WrenchCalibration::use;

  bool has_target() const;
  bool has_wrench() const;

  // In this order: each is held against those before it.
  void take_camera(SensorConfig& to) const;
  void take_target(SensorConfig& to) const;
  void name_wrench(SensorConfig& to) const;  ///< its path alone
  void take_zero(SensorConfig& to) const;
};

}  // namespace tagwrench
