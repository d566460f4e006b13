// `tagwrench design` for a file of hardware/sensors: whether it can be built, and what follows.
#pragma once

#include <string>

namespace tagwrench {

/// All complaints, one a line, to standard output; returns the exit status: 0 it can be built, 2 it
/// cannot. Throws ConfigError for a file that cannot be read.
int check_hardware(const std::string& file);

/// parameters.scad, sensor.yaml, scenario.yaml and plan.yaml (for `calibrate wrench`) of the
/// sensor, into `folder`, which may be there. Throws ConfigError for what cannot be built or
/// written, and, unless `force`, where one of these files is there and holds something else (a
/// calibration may have edited it): then nothing is written.
void export_hardware(const std::string& file, const std::string& folder, bool force);

}  // namespace tagwrench
