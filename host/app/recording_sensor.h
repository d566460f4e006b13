// The sensor of a recording: its files go in when it begins, and come out to replay it.
#pragma once

#include <filesystem>
#include <string>

#include "host/recording/records.h"
#include "host/sensor/sensor_config.h"

namespace tagwrench {

/// Puts text, measured files, and rest picture and calibration that the text names into the head.
/// `text` is that of `name`, a path that the others are relative to, or of a sensor that has no
/// file. A file that cannot be read is left out.
void take_sensor(const std::string& name, const std::string& text, record::Head& head);

/// The sensor as it was. Throws ConfigError, naming the recording, if it cannot be used.
SensorConfig recorded_sensor(const record::Head& head, const std::string& recording,
                             WrenchCalibration use = WrenchCalibration::use);

/// sensor.yaml and its measured/ into a folder, which may be one of frames; for a text that names a
/// picture or a calibration beside it sensor.yaml.rest and calibration.json, and a text that names
/// these, without the comments.
/// Throws ConfigError or std::runtime_error.
void write_recorded_sensor(const record::Head& head, const std::filesystem::path& folder);

}  // namespace tagwrench
