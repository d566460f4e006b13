// What calibration learned, written back into a sensor.yaml that people wrote.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "host/core/yaml/yaml_edit.h"

namespace tagwrench {

/// The edited text of sensor.yaml, checked as load_sensor would check it at `to`, then written
/// there. Throws ConfigError (nothing written) if the result would not be a usable sensor.yaml.
void write_sensor(std::string yaml, const std::vector<SectionEdit>& edits,
                  const std::filesystem::path& to);

}  // namespace tagwrench
