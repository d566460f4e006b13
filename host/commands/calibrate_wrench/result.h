// What a calibration leaves: progress while it is stopped, files of the fit, a table for people.
#pragma once

#include <algorithm>
#include <filesystem>
#include <string>
#include <vector>

#include "host/calibration/wrench/plan.h"
#include "host/calibration/wrench/record.h"
#include "host/sensor/calibration_file.h"
#include "host/wrench/fit.h"

namespace tagwrench {

struct Progress {
  std::vector<StepRecord> records;
  std::vector<int> skipped;
};

/// Each load has a rest of its zero before it. `steps` have step and zero.
template <class Steps>
bool zeros_fit(const Steps& steps, const WrenchPlan& plan) {
  int zero = -1;
  return std::all_of(steps.begin(), steps.end(), [&](const auto& s) {
    if (plan.steps[static_cast<std::size_t>(s.step)].kind == StepKind::rest) zero = s.zero;
    return s.zero == zero;
  });
}

/// What a file of progress belongs to.
struct ProgressOf {
  std::string plan_sha256;    ///< of the plan's text
  std::string sensor_sha256;  ///< of what identifies the sensor
};

/// Replaces the file as a whole. Throws std::runtime_error.
void save_progress(const std::filesystem::path& path, const ProgressOf& of,
                   const Progress& progress);

/// Throws ConfigError: it cannot be read, is no such file, or belongs to another plan or sensor.
Progress load_progress(const std::filesystem::path& path, const ProgressOf& of,
                       const WrenchPlan& plan);

struct CalibrationFiles {
  std::filesystem::path calibration;
  std::filesystem::path data;      ///< beside it
  std::filesystem::path progress;  ///< beside it
  std::filesystem::path before;    ///< what was in `calibration` until now
};

/// wrench.json -> wrench.data.csv, wrench.json.partial, wrench.json.before.
CalibrationFiles files_of(const std::filesystem::path& calibration);

/// Refuses a fit that knows no axis: springs as they were described are no calibration. Throws
/// ConfigError with every axis' reason.
void check_some_axis(const WrenchFit& fit);

/// What the calibration in the file knows by loads and this fit does not, in one line; empty:
/// nothing, or there is none.
std::string what_is_lost(const CalibrationFiles& files, const WrenchFit& fit);

/// Writes data and calibration. An earlier calibration is kept as `before`, and its data likewise.
/// Throws ConfigError or std::runtime_error; then the old calibration is in force.
void write_calibration(const CalibrationFiles& files, const WrenchData& data,
                       Calibration calibration);

/// One line per axis and one for each thing to be said. `range`: full load, N and N m; `known`:
/// the sensor's own, beyond kUnknownRange where nobody has told it.
std::vector<std::string> describe(const WrenchPlan& plan, const WrenchData& data,
                                  const WrenchFit& fit, const Vector6& range, const Vector6& known);

}  // namespace tagwrench
