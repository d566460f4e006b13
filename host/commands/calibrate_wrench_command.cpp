// `tagwrench calibrate wrench`: known loads, one by one, in; measured/wrench.json and its data out.
#include <fmt/chrono.h>
#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <optional>
#include <string>
#include <system_error>

#include "host/app/input.h"
#include "host/app/recording.h"
#include "host/calibration/wrench/plan.h"
#include "host/commands/calibrate_wrench/references.h"
#include "host/commands/calibrate_wrench/result.h"
#include "host/commands/calibrate_wrench/run.h"
#include "host/commands/commands.h"
#include "host/commands/measuring.h"
#include "host/commands/static_measurement.h"
#include "host/core/config_error.h"
#include "host/core/log.h"
#include "host/core/os/atomic_file.h"
#include "host/core/os/termination.h"
#include "host/core/sha256.h"
#include "host/sensor/calibration_file.h"
#include "host/sensor/measured_files.h"
#include "host/wrench/zero.h"

namespace tagwrench {
namespace {

namespace fs = std::filesystem;

struct CalibrateWrenchOptions : ReferenceInstrumentOptions {
  std::string sensor;  ///< path
  std::string source;  ///< SRC
  std::string plan;    ///< of a ready-made plan, or path; of a recording empty: its own
  std::string out;     ///< path; empty: measured/wrench.json beside `sensor`
  std::string notes;   ///< environment, for the record
  std::optional<RecordOptions> record;
  RecordOptions recording;   ///< becomes that
  std::string keep = "raw";  ///< of it
  bool resume = false;
  bool force = false;
  bool despite_damage = false;
  bool require_all = false;
  bool list_plans = false;
  std::string show_plan;          ///< name; printed to standard output
  std::optional<double> seconds;  ///< of the frames' own time, then stop as if interrupted
  int events = -1;                ///< descriptor, see Events; keys come from standard input then
};

constexpr int kRecordingFailed = 1, kAttempts = 3;  // attempts of the simulated person

int list_plans() {
  for (const ReadyPlan& ready : ready_plans()) {
    const WrenchPlan plan = parse_plan(ready.text, ready.name);
    fmt::print("{:18} {} steps: {}; about {} minutes\n", ready.name, plan.steps.size(), plan.about,
               plan.minutes);
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
  throw ConfigError(
      "{}: wrench: has no springs, so that nobody knows what a load should do; describe them "
      "roughly, wrench: {{springs: {{centres_mm: ..., axial_n_per_mm: ..., lateral_n_per_mm: "
      "...}}}}",
      file);
}

// What is refused before anything is measured; all throw ConfigError.

/// With `require_all` a plan that leaves an axis open; else says what will be completed. `range`:
/// full load, N and N m.
void check_plan(const WrenchPlan& plan, const Vector6& range, bool require_all) {
  std::string missing;
  for (const std::string& line : coverage_of(plan, range).missing())
    missing += (missing.empty() ? "" : "; ") + line;
  if (missing.empty()) return;
  if (require_all) throw ConfigError("--plan {}: {}; add steps", plan.name, missing);
  log_info(
      "--plan {}: {}; that stays as the spring model has it and is marked so (--require-all "
      "refuses)",
      plan.name, missing);
}

/// What is in the way of the files to be written.
void check_files(const CalibrationFiles& files, const CalibrateWrenchOptions& options) {
  std::error_code none;
  const fs::path folder = files.calibration.parent_path();
  if (folder.filename() == kMeasuredFolder && !fs::exists(folder, none))
    check_measurable(folder, {});
  else
    for (const fs::path& file : {files.calibration, files.data, files.progress, files.before})
      check_replaceable(file);
  const bool waits = fs::exists(files.progress, none);
  if (options.resume && !waits) {
    throw ConfigError("--resume: there is no {} to go on from; leave it out",
                      files.progress.string());
  }
  if (options.resume || options.force) return;
  if (waits) {
    throw ConfigError("{}: a calibration was stopped here; --resume goes on, --force begins anew",
                      files.progress.string());
  }
  if (!fs::exists(files.calibration, none)) return;
  try {
    read_calibration(files.calibration);
  } catch (const ConfigError&) {
    throw ConfigError("--out {}: is there, but is no calibration; name another file, or --force",
                      files.calibration.string());
  }
}

/// Pictures cannot be asked to hang a weight, and a person before a camera needs no pipe.
void check_source(const CalibrateWrenchOptions& options) {
  if (!options.emulated_cell.empty() && !parse_source(options.source).is(SourceKind::simulator)) {
    throw ConfigError("--emulated-cell: is for the simulated sensor, --source is {}; leave it out",
                      options.source);
  }
  if (parse_source(options.source).is(SourceKind::images)) {
    throw ConfigError(
        "--source {}: nobody is there who could do what the plan asks; give a camera, sim, or the "
        "recording of a calibration",
        options.source);
  }
  if (!options.record) return;
  check_recording(*options.record, "--record");
  if (options.resume) {
    throw ConfigError(
        "--record, --resume: what was measured before would not be in the recording; leave one "
        "out");
  }
}

/// What a recording has already, or cannot do any more.
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

/// A rest that is learned at the start is that of the mounting in which the program was started.
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
  throw ConfigError(
      "--resume: this sensor's rest is learned anew at every start, and now it lies otherwise than "
      "when {} was begun; run `tagwrench calibrate target`, then begin again with --force",
      partial.string());
}

std::string now_utc() {
  return fmt::format(
      "{:%Y-%m-%dT%H:%M:%SZ}",
      fmt::gmtime(std::chrono::system_clock::to_time_t(std::chrono::system_clock::now())));
}

/// Of what a measurement would have to begin anew for.
std::string sensor_sha256(const SensorConfig& sensor) {
  return sha256_of(identity_of(sensor.camera, sensor.target, sensor.rest));
}

/// What was measured, and what is said of it.
struct Measured {
  std::vector<StepRecord> records = {};
  std::string reference;
  double gain_sigma = 0;  ///< relative, of a load cell
  std::string notes;
  std::string date = {};  ///< UTC
};

Calibration calibration_of(const WrenchPlan& plan, const SensorConfig& sensor,
                           const Measured& measured, const WrenchData& data, const WrenchFit& fit) {
  Calibration out;
  out.sensor = identity_of(sensor.camera, sensor.target, sensor.rest);
  out.model = fit.model;
  CalibrationRecord& record = out.record;
  record.date = measured.date;
  record.software = std::string("tagwrench ") + TAGWRENCH_VERSION;
  record.plan = plan.name;
  record.reference = measured.reference;
  record.notes = measured.notes;
  if (data.lag.known) record.lag = {data.lag.value, data.lag.sigma};
  record.axis = fit.axis;
  record.inside_95 = fit.inside_95;
  record.missing = fit.missing;
  record.warnings = fit.warnings;
  record.trials = fit.trials;
  return out;
}

/// What is calibrated, and where to.
struct Subject {
  CalibrationFiles files;
  const SensorConfig& sensor;
  Matrix6 stiffness;  ///< known before
  Vector6 range;      ///< N and N m
};

fs::path measured_wrench(const CalibrateWrenchOptions& options) {
  return measured_folder(options.sensor) / kMeasuredWrench;
}

/// Whether the next run takes the result: by its place, or because sensor.yaml names it.
bool is_in_force(const CalibrateWrenchOptions& options, const CalibrationFiles& files) {
  const SensorConfig now = load_sensor(options.sensor, WrenchCalibration::ignore);
  std::error_code error;
  return fs::equivalent(now.calibration, files.calibration, error);
}

void fit_and_write(const CalibrateWrenchOptions& options, const Subject& subject,
                   const WrenchPlan& plan, const Measured& measured) {
  WrenchData data = collect(plan, measured.records, measured.gain_sigma);
  const WrenchFit fit = fit_wrench(data.observations, data.path,
                                   {.prior = subject.stiffness,
                                    .require_all = options.require_all,
                                    .zero_in_use = data.zero_in_use});
  check_some_axis(fit);
  const std::string poorer = what_is_lost(subject.files, fit);
  add_predictions(plan, fit, data);
  data.trial.sensor = sensor_sha256(subject.sensor);
  write_calibration(subject.files, data, calibration_of(plan, subject.sensor, measured, data, fit));
  std::error_code none;
  fs::remove(subject.files.progress, none);
  for (const std::string& line :
       describe(plan, data, fit, subject.range, subject.sensor.wrench.range))
    log_info(line);
  if (!poorer.empty()) log_info(poorer);
  log_info("written: {} and {}", subject.files.calibration.string(), subject.files.data.string());
  if (is_in_force(options, subject.files)) {
    void_zero(options.sensor);
  } else {
    log_info("it is in force as soon as it is {}, or {} names it as wrench.calibration",
             measured_wrench(options).string(), options.sensor);
  }
}

void check_sensor(const Input& input) {
  check_size(input);
  check_appearance(input);
}

int say_stopped(GuideEnd end, const WrenchGuide& guide, const fs::path& progress) {
  if (end == GuideEnd::failed) log_info(guide.failure());
  if (end == GuideEnd::ended) log_info("the source has ended before the plan");
  log_info(guide.records().empty()
               ? "stopped; nothing was measured, and the calibration in force stays"
               : fmt::format("stopped after {} steps, which are kept in {}; --resume goes on; the "
                             "calibration in force stays",
                             guide.records().size(), progress.string()));
  return kExitStopped;
}

/// Ends a recording. False: it is not whole.
bool end_recording(CalibrationRecorder& recorder, const std::string& file) {
  const std::string trouble = recorder.finish();
  const record::WriterState state = recorder.state();
  log_info("recording {}: {} frames, {:.3g} MB{}", file, state.frames,
           1e-6 * static_cast<double>(state.bytes),
           state.lost_frames > 0
               ? fmt::format("; the disk was too slow for {} of them; --keep region keeps less",
                             state.lost_frames)
               : "");
  if (!trouble.empty()) log_info(trouble);
  return trouble.empty() && state.lost_frames == 0 && state.lost_others == 0;
}

int calibrate_live(const CalibrateWrenchOptions& options, const CalibrationFiles& files) {
  const std::string text = plan_text(options.plan);
  const WrenchPlan plan = parse_plan(text, options.plan);
  check_measurable(measured_folder(options.sensor), {kMeasuredZero});
  check_files(files, options);
  check_source(options);
  BenchInput at =
      open_at_bench({options.sensor, options.source, /*fast=*/options.emulated_cell.empty(),
                     WrenchCalibration::ignore});
  const SensorConfig& sensor = at.input.sensor;
  check_sensor(at.input);

  const Subject subject{files, sensor, known_stiffness(sensor, options.sensor), full_load(sensor)};
  check_plan(plan, subject.range, options.require_all);
  const ProgressOf of{sha256_hex(text), sensor_sha256(sensor)};
  WrenchGuide guide(plan, {.stiffness = subject.stiffness,
                           .range = subject.range,
                           .attempts = at.bench ? kAttempts : 0});
  if (options.resume) {
    const Progress progress = load_progress(files.progress, of, plan);
    check_resumable(sensor, plan, progress, files.progress);
    guide.resume(progress.records, progress.skipped);
    log_info("going on: {} steps are done", progress.records.size());
  }
  const std::unique_ptr<Reference> reference =
      open_reference(plan, options, at.bench.get(), at.time_zero);
  log_info("source: " + at.input.source->format().description);
  if (reference) log_info("reference: " + reference->description());
  if (!rest_is_calibrated(sensor)) {
    log_info(
        "this sensor's rest is learned anew at every start; run `tagwrench calibrate target` first "
        "if `check`, `zero` and --resume shall work: newtons hold for the target as it was");
  }
  Measured measured{.reference = reference  ? reference->description()
                                 : at.bench ? "simulated masses"
                                            : "masses",
                    .gain_sigma = reference ? reference->gain_sigma() : 0,
                    .notes = options.notes};

  const UniqueFd stop = termination_fd();
  std::optional<CalibrationRecorder> recorder;
  if (options.record) {
    record::Head head = recording_head(at.input, options.record->keep);
    put_into(head, {options.plan, text, measured.reference, measured.gain_sigma, measured.notes});
    recorder.emplace(record::WriterOptions{.path = options.record->file,
                                           .lossless = at.input.source->poll_fd() < 0},
                     head);
  }
  Events events(options.events);
  const GuideEnd end = run_guide({&at, reference.get(), recorder ? &*recorder : nullptr, &stop,
                                  &plan, files.progress, of, options.seconds, &events},
                                 guide);
  const bool recorded = !recorder || end_recording(*recorder, options.record->file);
  if (end != GuideEnd::done) return say_stopped(end, guide, files.progress);
  measured.records = guide.records();
  measured.date = now_utc();
  fit_and_write(options, subject, plan, measured);
  return recorded ? 0 : kRecordingFailed;
}

/// The plan that is given, which must ask for the same steps, or the recording's own.
WrenchPlan plan_of_recording(const CalibrateWrenchOptions& options,
                             const RecordedCalibration& recorded) {
  if (recorded.plan_yaml.empty()) {
    throw ConfigError(
        "--source {}: holds no calibration; record one with `tagwrench calibrate wrench --record "
        "FILE`",
        options.source);
  }
  WrenchPlan its = parse_plan(recorded.plan_yaml, recorded.plan);
  if (options.plan.empty()) return its;
  WrenchPlan ours = parse_plan(plan_text(options.plan), options.plan);
  const bool same = ours.reference == its.reference && ours.cell_channel == its.cell_channel &&
                    std::equal(ours.steps.begin(), ours.steps.end(), its.steps.begin(),
                               its.steps.end(), [](const PlanStep& a, const PlanStep& b) {
                                 return a.kind == b.kind && a.visit == b.visit;
                               });
  if (!same) {
    throw ConfigError(
        "--plan {}: asks for other steps than the recording's plan, {}; correct its numbers only, "
        "or leave --plan out",
        options.plan, recorded.plan);
  }
  return ours;
}

/// As known_stiffness(); of a sensor without springs what the recorded one began with.
Matrix6 stiffness_before(const SensorConfig& sensor, const record::RecordingReader& recording) {
  if (sensor.spring_stiffness) return *sensor.spring_stiffness;
  return recorded_sensor(recording.head(), recording.path().string()).wrench.K;
}

/// The loads of an earlier calibration once more.
int calibrate_again(const CalibrateWrenchOptions& options, const CalibrationFiles& files) {
  check_replay_options(options);
  check_measurable(measured_folder(options.sensor), {kMeasuredZero});
  check_files(files, options);
  const record::IfDamaged damaged = if_damaged(options.despite_damage);
  record::RecordingReader recording(parse_source(options.source).argument, damaged);
  const RecordedCalibration recorded = calibration_in(recording.head());
  const WrenchPlan plan = plan_of_recording(options, recorded);
  const std::vector<AcceptedStep> steps = accepted_steps(recording, plan);
  Input input = open_input(
      {options.sensor, options.source, /*fast=*/true, WrenchCalibration::ignore, damaged});
  const SensorConfig& sensor = input.sensor;
  check_sensor(input);
  const SensorConfig then =
      recorded_sensor(recording.head(), recording.path().string(), WrenchCalibration::ignore);
  const std::string other = difference(identity_of(then.camera, then.target, then.rest),
                                       identity_of(sensor.camera, sensor.target, sensor.rest));
  if (!other.empty()) log_info("recorded with another sensor.yaml ({}); --sensor counts", other);
  const Subject subject{files, sensor, stiffness_before(sensor, recording), full_load(sensor)};
  check_plan(plan, subject.range, options.require_all);
  log_info("source: " + input.source->format().description);
  log_info("plan {}, {}: {} steps were accepted", plan.name, recorded.reference, steps.size());
  if (const std::string missing = not_recorded(steps, plan); !missing.empty())
    log_info("not in the recording: " + missing);

  std::vector<StepRecord> records = replay_steps(input, recording, steps, plan);
  check_whole(*input.source, damaged);
  fit_and_write(options, subject, plan,
                {.records = std::move(records),
                 .reference = recorded.reference,
                 .gain_sigma = recorded.gain_sigma,
                 .notes = options.notes.empty() ? recorded.notes : options.notes,
                 .date = recording.head().created});
  return 0;
}

/// 1: stopped or failed on the way, what was measured is kept for --resume; or written, but a
/// recording that was asked for is not whole. Throws ConfigError if it cannot start, or if what was
/// measured makes no calibration. One that was in force stays so until the new one is complete.
int calibrate_wrench(const CalibrateWrenchOptions& options) {
  if (options.list_plans) return list_plans();
  if (!options.show_plan.empty()) {
    print_data(plan_text(options.show_plan));
    return 0;
  }
  const CalibrationFiles files =
      files_of(options.out.empty() ? measured_wrench(options) : fs::path(options.out));
  return parse_source(options.source).is(SourceKind::recording) ? calibrate_again(options, files)
                                                                : calibrate_live(options, files);
}

}  // namespace

void calibrate_wrench_command(command_line::Command family) {
  const auto o = std::make_shared<CalibrateWrenchOptions>();
  auto verb = family.add_subcommand("wrench", "newtons, from known loads; step by step");
  verb.add_flag("--list-plans", o->list_plans, "name the ready-made plans");
  verb.add_option("--show-plan", o->show_plan, "print a plan, to be changed and given as a file");
  verb.add_option("--sensor", o->sensor, "sensor.yaml of this sensor");
  verb.add_option(
      "--source", o->source,
      "sim | sim:SCENARIO.yaml, which loads itself, or v4l2:/dev/videoN[,WxH[@FPS][,FOURCC]]; or "
      "recording:FILE of --record, whose loads are fitted once more");
  verb.add_option(
      "--plan", o->plan,
      "a ready-made plan (--list-plans) or a plan file; of a recording, without it its own");
  verb.add_option("--out", o->out,
                  "file to write; without it measured/wrench.json beside --sensor");
  verb.add_option("--notes", o->notes, "temperature, place, who: goes into the record");
  auto board =
      verb.add_option("--board", o->board, "serial port of the board with the load cell, or auto");
  verb.add_option("--cells", o->cells,
                  "its load cells' calibration; without it the one kept for this board");
  verb.add_option("--emulated-cell", o->emulated_cell,
                  "with --source sim and an emulated board: the pipe that the board reads its "
                  "orders from, so that its cell feels the simulated hand; in real time")
      .needs(board);
  verb.add_option("--optoforce", o->optoforce, "serial port of an OptoForce sensor");
  verb.add_option("--counts-per-unit", o->counts_per_unit,
                  "of that, from its data sheet: per N of Fx Fy Fz, per N m of Tx Ty Tz")
      .delimiter(',')
      .expected(6)
      .check(command_line::positive_number());
  auto record = verb.add_option(
      "--record", o->recording.file,
      "keep frames, readings and accepted steps in a new file, for --source recording:FILE");
  verb.add_option("--keep", o->keep,
                  "what of each frame is recorded:\n"
                  "  raw       as it came from the source (MJPG stays MJPG)\n"
                  "  region    grey pixels of the part around the tags")
      .check(command_line::one_of({"raw", "region"}))
      .capture_default_str()
      .needs(record);
  verb.add_flag(kDespiteDamage, o->despite_damage, kDespiteDamageHelp);
  verb.add_flag("--resume", o->resume, "go on with a calibration that was stopped");
  verb.add_flag("--force", o->force, "begin anew, whatever is there");
  verb.add_flag(
      "--require-all", o->require_all,
      "refuse unless all six axes are measured, in place of completing them from the spring model");
  verb.add_option("--seconds", o->seconds, "stop after S seconds of frames; --resume goes on")
      .check(calibration_seconds());
  add_events_option(verb, o->events);
  const auto check = [=] {
    if (o->list_plans || !o->show_plan.empty()) return;
    const bool recorded = o->source.starts_with("recording:");
    for (const char* needed : {"--sensor", "--source", "--plan"}) {
      const bool optional = recorded && std::string_view(needed) == "--plan";
      if (verb.count(needed) == 0 && !optional) command_line::missing(needed);
    }
    if (o->recording.file.empty()) return;
    o->recording.keep = o->keep == "raw" ? record::Keep::raw : record::Keep::region;
    o->record = o->recording;
  };
  verb.runs([o] { return calibrate_wrench(*o); }, check);
}

}  // namespace tagwrench
