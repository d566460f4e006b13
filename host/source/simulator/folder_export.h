// A scenario as a folder: pictures, their times, the truth, and the sensor file that its user would
// have.
#pragma once

#include <filesystem>
#include <string>

#include "host/source/simulator/scenario.h"

namespace tagwrench::sim {

/// sensor.yaml as the owner of this sensor would write it: camera calibration, family, ids and
/// nominal springs. Where the tags were glued stays unknown to it.
std::string sensor_yaml(const Scenario& scenario);

/// Writes 000000.png (or .pgm, .jpg) ..., frames.csv, sensor.yaml and truth.csv into `dir`, all or
/// nothing: they appear when the last one is written. An earlier export in `dir` is replaced; any
/// other content is left alone and refused. Throws ConfigError if the scenario or the folder cannot
/// be used, std::runtime_error if writing fails (disk full).
void export_folder(const Scenario& scenario, const std::filesystem::path& dir, int frames);

}  // namespace tagwrench::sim
