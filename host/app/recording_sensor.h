// The sensor of a recording: its files go in when it begins, and come out to replay it.
#pragma once

#include <filesystem>
#include <string>

#include "host/recording/records.h"
#include "host/sensor/sensor_config.h"

namespace tagwrench {

/// Puts text, rest picture and calibration into the head. `text` is that of `name`, a path that the
/// other two are relative to. A file that cannot be read is left out.
void take_sensor(const std::string& name, const std::string& text, record::Head& head);

/// The sensor as it was. Throws ConfigError, naming the recording, if it cannot be used.
SensorConfig recorded_sensor(const record::Head& head, const std::string& recording,
                             WrenchCalibration use = WrenchCalibration::use);

/// sensor.yaml, and beside it sensor.yaml.rest (its appearance) and calibration.json where it has
/// them, into a folder, which may be one of frames.
/// Throws ConfigError or std::runtime_error.
void write_recorded_sensor(const record::Head& head, const std::filesystem::path& folder);

}  // namespace tagwrench
