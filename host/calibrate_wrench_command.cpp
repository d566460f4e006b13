#include "host/calibrate_wrench_command.h"

#include <fmt/chrono.h>
#include <fmt/format.h>

#include <array>
#include <cstdio>
#include <filesystem>
#include <system_error>

#include "host/calibrate_wrench/references.h"
#include "host/calibrate_wrench/result.h"
#include "host/calibrate_wrench/run.h"
#include "host/config/plan_config.h"
#include "host/config/sensor_edit.h"
#include "host/config/sha256.h"
#include "host/config_error.h"
#include "host/tell.h"

namespace tagwrench {
namespace {

namespace fs = std::filesystem;

constexpr int kStopped = 1;
constexpr int kAttempts = 3;  // of the simulated person
constexpr double kUnknownRange = 1e8;

int list_plans() {
  for (const ReadyPlan& ready : ready_plans()) {
    const WrenchPlan plan = parse_plan(ready.text, ready.name);
    std::fputs(
        fmt::format("{:18} {} steps: {}\n", ready.name, plan.steps.size(), plan.about).c_str(),
        stdout);
  }
  return 0;
}

/// Full load per axis: the sensor's, or where its sensor.yaml tells none the paper's.
Vector6 full_load(const SensorConfig& sensor) {
  const Vector6 usual = (Vector6() << 1, 1, 2.5, 0.016, 0.016, 0.009).finished();
  return (sensor.wrench.range.array() < kUnknownRange).select(sensor.wrench.range, usual);
}

/// What is known before: the springs as described, or the calibration in force.
Matrix6 known_stiffness(const SensorConfig& sensor, const std::string& file) {
  if (sensor.spring_stiffness) return *sensor.spring_stiffness;
  if (!sensor.calibration.empty()) return load_sensor(file).wrench.K;
  throw ConfigError(fmt::format(
      "{}: wrench: has no springs, so that nobody knows what a load should do; describe them "
      "roughly, wrench: {{springs: {{centres_mm: ..., axial_n_per_mm: ..., lateral_n_per_mm: "
      "...}}}}",
      file));
}

/// Refuses a plan that leaves something open, or says what will be completed.
void check_plan(const WrenchPlan& plan, const Vector6& range, bool require_all) {
  std::string missing;
  for (const std::string& line : coverage_of(plan, range).missing())
    missing += (missing.empty() ? "" : "; ") + line;
  if (missing.empty()) return;
  if (require_all) throw ConfigError(fmt::format("--plan {}: {}; add steps", plan.name, missing));
  tell(
      fmt::format("--plan {}: {}; that stays as the spring model has it and is marked so "
                  "(--require-all refuses)",
                  plan.name, missing));
}

/// What is in the way of the files to be written.
void check_files(const CalibrationFiles& files, const CalibrateWrenchOptions& options) {
  for (const fs::path& file : {files.calibration, files.data, files.progress, files.before})
    check_replaceable(file);
  std::error_code none;
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

/// Pictures cannot be asked to hang a weight.
void check_source(const std::string& source) {
  const std::string kind = split_spec(source).kind;
  if (kind == "images" || kind == "recording") {
    throw ConfigError(fmt::format(
        "--source {}: nobody is there who could do what the plan asks; give a camera or sim",
        source));
  }
}

std::string now_utc() {
  return fmt::format(
      "{:%Y-%m-%dT%H:%M:%SZ}",
      fmt::gmtime(std::chrono::system_clock::to_time_t(std::chrono::system_clock::now())));
}

/// Of what a measurement would have to begin anew for.
std::string sensor_sha256(const SensorConfig& sensor) {
  const SensorIdentity id = identity_of(sensor.camera, sensor.target, sensor.rest);
  std::string text = fmt::format("{} {}x{}", id.target_sha256, id.image_px[0], id.image_px[1]);
  for (const double number : id.lens_px.value_or(std::array<double, 4>{}))
    text += fmt::format(" {:.6f}", number);
  return sha256_hex(text);
}

Calibration calibration_of(const CalibrateWrenchOptions& options, const WrenchPlan& plan,
                           const SensorConfig& sensor, const WrenchData& data, const WrenchFit& fit,
                           const Reference* reference) {
  Calibration out;
  out.sensor = identity_of(sensor.camera, sensor.target, sensor.rest);
  out.model = fit.model;
  CalibrationRecord& record = out.record;
  record.date = now_utc();
  record.software = std::string("tagwrench ") + TAGWRENCH_VERSION;
  record.plan = plan.name;
  record.reference = reference != nullptr ? reference->description() : "masses";
  record.notes = options.notes;
  if (data.lag.known) record.lag = {data.lag.value, data.lag.sigma};
  record.axis = fit.axis;
  record.inside_95 = fit.inside_95;
  record.missing = fit.missing;
  record.warnings = fit.warnings;
  record.trials = fit.trials;
  return out;
}

int say_stopped(GuideEnd end, const WrenchGuide& guide, const fs::path& progress) {
  if (end == GuideEnd::failed) tell(guide.failure());
  if (end == GuideEnd::ended) tell("the source has ended before the plan");
  tell(guide.records().empty()
           ? "stopped; nothing was measured, and the calibration in force stays"
           : fmt::format("stopped after {} steps, which are kept in {}; --resume goes on; the "
                         "calibration in force stays",
                         guide.records().size(), progress.string()));
  return kStopped;
}

}  // namespace

int calibrate_wrench(const CalibrateWrenchOptions& options) {
  if (options.list_plans) return list_plans();
  if (!options.show_plan.empty()) {
    std::fputs(plan_text(options.show_plan).c_str(), stdout);
    return 0;
  }
  const std::string text = plan_text(options.plan);
  const WrenchPlan plan = parse_plan(text, options.plan);
  const std::string sensor_text = read_text(options.sensor);
  const CalibrationFiles files =
      files_of(options.out.empty() ? fs::path(options.sensor).parent_path() / "calibration.json"
                                   : fs::path(options.out));
  check_replaceable(options.sensor);
  check_files(files, options);
  check_source(options.source);
  BenchInput at =
      open_at_bench({options.sensor, options.source, /*fast=*/true, WrenchCalibration::ignore});
  const SensorConfig& sensor = at.input.sensor;
  check_editable(sensor_text, {{"wrench", {{"calibration", "''"}}}}, options.sensor);
  check_size(at.input);
  check_appearance(at.input);

  GuideOptions guide_options;
  guide_options.stiffness = known_stiffness(sensor, options.sensor);
  guide_options.range = full_load(sensor);
  guide_options.attempts = at.bench ? kAttempts : 0;
  check_plan(plan, guide_options.range, options.require_all);
  const ProgressOf of{sha256_hex(text), sensor_sha256(sensor)};
  WrenchGuide guide(plan, guide_options);
  if (options.resume) {
    const Progress progress = load_progress(files.progress, of, plan);
    guide.resume(progress.records, progress.skipped);
    tell(fmt::format("going on: {} steps are done", progress.records.size()));
  }
  const std::unique_ptr<Reference> reference = open_reference(
      plan, {options.board, options.cells, options.optoforce, options.counts_per_unit},
      at.bench.get(), TimePoint{});
  tell("source: " + at.input.source->format().description);
  if (reference) tell("reference: " + reference->description());

  const GuideEnd end =
      run_guide({&at, reference.get(), &plan, files.progress, of, options.seconds}, guide);
  if (end != GuideEnd::done) return say_stopped(end, guide, files.progress);

  const WrenchData data = collect(plan, guide.records(), reference ? reference->gain_sigma() : 0);
  const WrenchFit fit = fit_wrench(data.observations, data.path,
                                   {.prior = guide_options.stiffness,
                                    .require_all = options.require_all,
                                    .zero_in_use = data.zero_in_use});
  write_calibration(files, sensor_text, options.sensor, sensor, data,
                    calibration_of(options, plan, sensor, data, fit, reference.get()));
  std::error_code none;
  fs::remove(files.progress, none);
  for (const std::string& line : describe(plan, data, fit, guide_options.range)) tell(line);
  tell(fmt::format("written: {}, {} and wrench.calibration in {}", files.calibration.string(),
                   files.data.string(), options.sensor));
  return 0;
}

}  // namespace tagwrench
