// A calibration that was stopped: what it has measured, until it goes on.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "host/calibration/wrench/plan.h"
#include "host/calibration/wrench/record.h"

namespace tagwrench {

struct Progress {
  std::vector<StepRecord> records;
  std::vector<int> skipped;
};

/// What a file of progress belongs to.
struct ProgressOf {
  std::string plan_sha256;    ///< of the plan's text
  std::string sensor_sha256;  ///< of what identifies the sensor
};

/// Replaces the file as a whole. Throws std::runtime_error.
void save_progress(const std::filesystem::path& path, const ProgressOf& of,
                   const Progress& progress);

/// Throws ConfigError if it cannot be read, is not such a file, or belongs to another plan or
/// another sensor.
Progress load_progress(const std::filesystem::path& path, const ProgressOf& of,
                       const WrenchPlan& plan);

}  // namespace tagwrench
