#include "host/commands/calibrate_wrench/checks.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <string>
#include <system_error>

#include "host/app/input.h"
#include "host/app/sources.h"
#include "host/calibration/wrench/coverage.h"
#include "host/commands/static_measurement.h"
#include "host/core/config_error.h"
#include "host/core/log.h"
#include "host/core/os/atomic_file.h"
#include "host/sensor/calibration_file.h"
#include "host/sensor/measured_files.h"

namespace tagwrench {

namespace fs = std::filesystem;

void check_plan(const WrenchPlan& plan, const Vector6& range, bool require_all) {
  std::string missing;
  for (const std::string& line : coverage_of(plan, range).missing())
    missing += (missing.empty() ? "" : "; ") + line;
  if (missing.empty()) return;
  if (require_all) throw ConfigError(fmt::format("--plan {}: {}; add steps", plan.name, missing));
  log_info(
      fmt::format("--plan {}: {}; that stays as the spring model has it and is marked so "
                  "(--require-all refuses)",
                  plan.name, missing));
}

void check_files(const CalibrationFiles& files, const CalibrateWrenchOptions& options) {
  std::error_code none;
  const fs::path folder = files.calibration.parent_path();
  if (folder.filename() == kMeasuredFolder && !fs::exists(folder, none)) {
    check_measurable(folder, {});
  } else {
    for (const fs::path& file : {files.calibration, files.data, files.progress, files.before})
      check_replaceable(file);
  }
  const bool waits = fs::exists(files.progress, none);
  if (options.resume && !waits) {
    throw ConfigError(fmt::format("--resume: there is no {} to go on from; leave it out",
                                  files.progress.string()));
  }
  if (options.resume || options.force) return;
  if (waits) {
    throw ConfigError(
        fmt::format("{}: a calibration was stopped here; --resume goes on, --force begins anew",
                    files.progress.string()));
  }
  if (!fs::exists(files.calibration, none)) return;
  try {
    read_calibration(files.calibration);
  } catch (const ConfigError&) {
    throw ConfigError(
        fmt::format("--out {}: is there, but is no calibration; name another file, "
                    "or --force",
                    files.calibration.string()));
  }
}

void check_source(const CalibrateWrenchOptions& options) {
  if (!options.emulated_cell.empty() && !parse_source(options.source).is(SourceKind::simulator)) {
    throw ConfigError(
        fmt::format("--emulated-cell: is for the simulated sensor, --source is {}; leave it out",
                    options.source));
  }
  if (parse_source(options.source).is(SourceKind::images)) {
    throw ConfigError(fmt::format(
        "--source {}: nobody is there who could do what the plan asks; give a camera, sim, or the "
        "recording of a calibration",
        options.source));
  }
  if (!options.record) return;
  check_recording(*options.record, "--record");
  if (options.resume) {
    throw ConfigError(
        "--record, --resume: what was measured before would not be in the recording; leave one "
        "out");
  }
}

void check_replay_options(const CalibrateWrenchOptions& options) {
  if (!options.record && !options.resume && !options.seconds && options.board.empty() &&
      options.cells.empty() && options.optoforce.empty() && options.counts_per_unit.empty() &&
      options.emulated_cell.empty())
    return;
  throw ConfigError(
      "--record, --resume, --seconds, --board, --cells, --optoforce, --counts-per-unit, "
      "--emulated-cell: are for loads that are still to come, the recording has its own; leave "
      "them out");
}

void check_resumable(const SensorConfig& sensor, const WrenchPlan& plan, const Progress& progress,
                     const fs::path& partial) {
  if (rest_is_calibrated(sensor)) return;
  int next = 0;
  const auto done = [&] {
    return std::any_of(progress.records.begin(), progress.records.end(),
                       [&](const StepRecord& record) { return record.step == next; }) ||
           std::find(progress.skipped.begin(), progress.skipped.end(), next) !=
               progress.skipped.end();
  };
  while (next < static_cast<int>(plan.steps.size()) && done()) ++next;
  if (next == static_cast<int>(plan.steps.size()) ||
      plan.steps[static_cast<std::size_t>(next)].mounting == plan.steps.front().mounting)
    return;
  throw ConfigError(fmt::format(
      "--resume: this sensor's rest is learned anew at every start, and now it lies otherwise than "
      "when {} was begun; run `tagwrench calibrate target`, then begin again with --force",
      partial.string()));
}

}  // namespace tagwrench
