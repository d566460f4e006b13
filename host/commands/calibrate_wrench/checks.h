// What `calibrate wrench` refuses before anything is measured. All throw ConfigError that names the
// option or the file and the remedy.
#pragma once

#include <filesystem>

#include "host/calibration/wrench/plan.h"
#include "host/commands/calibrate_wrench/progress.h"
#include "host/commands/calibrate_wrench/result.h"
#include "host/commands/calibrate_wrench_command.h"
#include "host/sensor/sensor_config.h"

namespace tagwrench {

/// With `require_all` a plan that leaves an axis open; else says what will be completed. `range`:
/// full load, N and N m.
void check_plan(const WrenchPlan& plan, const Vector6& range, bool require_all);

/// What is in the way of the files to be written.
void check_files(const CalibrationFiles& files, const CalibrateWrenchOptions& options);

/// Pictures cannot be asked to hang a weight, and a person before a camera needs no pipe.
void check_source(const CalibrateWrenchOptions& options);

/// What a recording has already, or cannot do any more.
void check_replay_options(const CalibrateWrenchOptions& options);

/// A rest that is learned at the start is that of the mounting in which the program was started.
void check_resumable(const SensorConfig& sensor, const WrenchPlan& plan, const Progress& progress,
                     const std::filesystem::path& partial);

}  // namespace tagwrench
