// `tagwrench check`: whether a calibrated sensor still measures what it did, found out where it
// stands. `tagwrench zero`: what it reads with hands off becomes its zero, in measured/zero.yaml.

#include <fmt/format.h>

#include <cmath>
#include <filesystem>
#include <iostream>
#include <limits>
#include <memory>
#include <numbers>
#include <optional>
#include <vector>

#include "host/app/board/run_board.h"
#include "host/app/input.h"
#include "host/board/cell_calibration.h"
#include "host/commands/calibrate_wrench/references.h"
#include "host/commands/commands.h"
#include "host/commands/measuring.h"
#include "host/commands/static_measurement.h"
#include "host/core/config_error.h"
#include "host/core/log.h"
#include "host/core/os/termination.h"
#include "host/core/printable.h"
#include "host/sensor/measured_files.h"
#include "host/tracker/rotation.h"

namespace tagwrench {
namespace {

struct CheckOptions {
  std::string sensor;            ///< path
  std::string source;            ///< SRC
  int events = -1;               ///< descriptor, see Events
  std::optional<double> mass_g;  ///< to be hung
  double mass_sigma_percent = 0.5;
  std::vector<double> at_mm;  ///< where a load takes hold, platform frame
  double at_sigma_mm = 0.3;
  std::vector<double> gravity{0, 0, -1};  ///< along which masses pull, camera axes
  double direction_sigma_deg = 1;         ///< of gravity
  std::string board;                      ///< port of the board whose load cell tells the force
  std::string cells;                      ///< calibration of its load cells
  int channel = 0;
  std::vector<double> direction;  ///< of the force on the platform, camera axes
  std::string emulated_cell;      ///< pipe to the emulated board, for its cell; empty: none
};

constexpr int kOff = 1;
constexpr Duration kPatience = std::chrono::seconds(20);
constexpr Duration kPatienceForMass = std::chrono::seconds(60);
constexpr Duration kMinPush = std::chrono::seconds(8);
constexpr double kKnownScale = 0.004;  // standard deviation at which pushing may end
constexpr double kMin = 1e-9;          // of a direction

Eigen::Vector3d vector3(const std::vector<double>& v) { return {v[0], v[1], v[2]}; }

command_line::Check finite() {
  constexpr double kMax = std::numeric_limits<double>::max();
  return command_line::number(-kMax, kMax, "a number", "NUMBER");
}

int stopped() {
  log_info("stopped");
  return kOff;
}

/// Prints the findings; whether all are fine.
bool print(const std::vector<InSituFinding>& findings) {
  bool fine = true;
  for (const InSituFinding& finding : findings) {
    std::cout << printable(text(finding)) << '\n';
    // One tag alone cannot be compared, ever: that is no fault of today.
    const bool by_design = finding.subject == Subject::tags && finding.fault == Fault::not_known;
    fine = fine && (finding.fine() || by_design);
  }
  std::cout.flush();
  return fine;
}

/// M = r x F, where r is where the point has gone with the platform; and what is not known of mass,
/// point and direction.
void set_known(const CheckOptions& options, const Vector6& displacement, ProofLoad& load) {
  const Eigen::Vector3d point = vector3(options.at_mm) * 1e-3;
  const double force = *options.mass_g * 1e-3 * link::kStandardGravity;
  const Eigen::Vector3d f = force * vector3(options.gravity).normalized();
  const Eigen::Vector3d r =
      displacement.head<3>() + rotation_from_vector(displacement.tail<3>()) * point;
  load.known << f, r.cross(f);
  const double turn = options.direction_sigma_deg * std::numbers::pi / 180;
  const double shift = options.at_sigma_mm * 1e-3;
  const double size = options.mass_sigma_percent * 1e-2;
  Matrix6 covariance = size * size * load.known * load.known.transpose();
  for (int i = 0; i < 3; ++i) {
    const Eigen::Vector3d e = Eigen::Vector3d::Unit(i);
    Vector6 turned, shifted;
    turned << e.cross(f), r.cross(e.cross(f));
    shifted << Eigen::Vector3d::Zero(), e.cross(f);
    covariance +=
        turn * turn * turned * turned.transpose() + shift * shift * shifted * shifted.transpose();
  }
  load.known_covariance = covariance;
}

/// The simulated hand on the cell, for as long as anyone has patience with it.
void simulated_push(sim::Bench& bench, const Vector6& range, const ReferenceLine& line) {
  constexpr double kShare = 0.6;  // of what the weakest axis bears
  constexpr int kStrokes = 8;
  Vector6 of_newton;
  of_newton << line.direction, line.point.cross(line.direction);
  const double most = 1 / of_newton.cwiseAbs().cwiseQuotient(range).maxCoeff();
  bench.push(line.point, line.direction, kShare * most,
             std::chrono::duration<double>(kPatience).count(), kStrokes);
}

/// How far the wrench must go before the load is taken to be there, of the range.
double least_change(const CheckOptions& options, const Vector6& range) {
  ProofLoad load;
  set_known(options, Vector6::Zero(), load);
  return 0.3 * load.known.cwiseQuotient(range).cwiseAbs().maxCoeff();
}

bool by_mass(const CheckOptions& options, BenchInput& at, const UniqueFd& stop,
             StaticMeasurement& static_measurement, Events& events) {
  ProofLoad load;
  load.range = at.input.sensor.wrench.range;
  const Vector6 before = static_measurement.result().wrench;
  static_measurement.wait_for_change(least_change(options, load.range));
  log_info("now hang {:g} g at ({:g}, {:g}, {:g}) mm, and let it come to rest", *options.mass_g,
           options.at_mm[0], options.at_mm[1], options.at_mm[2]);
  if (at.bench) at.bench->hang(*options.mass_g * 1e-3, vector3(options.at_mm) * 1e-3);
  const Seen loaded = watch(*at.input.source, stop, static_measurement, events);
  InSituFinding scale{.subject = Subject::scale, .fault = Fault::not_known};
  if (loaded == Seen::enough && static_measurement.result().held) {
    load.measured = static_measurement.result().wrench - before;
    load.measured_covariance = static_measurement.wrench_sigma().cwiseAbs2().asDiagonal();
    set_known(options, static_measurement.displacement(), load);
    scale = judge(load);
  }
  return loaded != Seen::stopped && print({scale});
}

/// Until the scale is known well, or patience is lost.
bool by_cell(const CheckOptions& options, BenchInput& at, const UniqueFd& stop,
             const RunBoard& board, Output& cell) {
  const SensorConfig& sensor = at.input.sensor;
  Tracker tracker = make_tracker(sensor);
  WrenchEstimator wrench(sensor.wrench);
  std::optional<EmulatedCell> hand;
  if (!options.emulated_cell.empty())
    hand.emplace(options.emulated_cell, options.channel, *at.bench, at.time_zero);
  log_info("now push with the load cell, slowly, on and off, for some seconds");
  if (hand) simulated_push(*at.bench, sensor.wrench.range, *sensor.reference);
  std::optional<TimePoint> begin;
  while (true) {
    Frame frame;
    const Next next = next_frame(*at.input.source, stop, frame);
    if (next == Next::stopped) return false;
    if (next == Next::end) break;
    if (hand) hand->follow();
    if (const std::string_view news = cell.service(); !news.empty()) log_info(news);
    if (next != Next::frame) continue;
    if (!begin) begin = frame.capture_time;
    Sample sample{.capture_time = frame.capture_time, .latency_origin = frame.latency_origin};
    const Track track = tracker.track(frame);
    wrench.estimate(track, sample);
    cell.send(sample);
    const Duration pushed = frame.capture_time - *begin;
    const bool known = board.monitor().scale_sigma() < kKnownScale;
    if (pushed >= kPatience || (known && pushed >= kMinPush)) break;
  }
  return print({judge(board.monitor())});
}

/// 0: all is fine; 1: something is not, or could not be told.
int check(const CheckOptions& options) {
  if (!(vector3(options.gravity).norm() > kMin))
    throw ConfigError("--gravity: has no length; give a direction such as 0,0,-1");
  if (!options.direction.empty() && !(vector3(options.direction).norm() > kMin))
    throw ConfigError("--direction: has no length; give a direction such as 0,0,-1");
  const UniqueFd stop = termination_fd();
  const std::unique_ptr<RunBoard> board = open_board(options.board, options.cells);
  if (board && !board->connected()) return stopped();
  BenchInput at;
  const InputOptions from{options.sensor, options.source, /*fast=*/!board};
  if (board && options.emulated_cell.empty())
    at.input = open_input(from);  // a board has its own time
  else
    at = open_at_bench(from);
  if (!options.emulated_cell.empty() && !at.bench) {
    throw ConfigError("--emulated-cell: is for the simulated sensor, --source is {}; leave it out",
                      options.source);
  }
  Input& input = at.input;
  check_size(input);
  check_calibrated_rest(input.sensor, "check");
  if (board && !board->settle_light(input, stop)) return stopped();
  StaticMeasurement static_measurement(input.sensor, std::chrono::seconds(2),
                                       options.mass_g ? kPatienceForMass : kPatience);
  Events events(options.events);
  log_info("source: " + input.source->format().description);
  log_info("hands off for some seconds");
  std::unique_ptr<Output> cell;
  if (board) {
    input.sensor.reference = ReferenceLine{options.channel, vector3(options.at_mm) * 1e-3,
                                           vector3(options.direction).normalized()};
    cell = board->output(input.sensor, "");
  }
  const Seen seen = watch(*input.source, stop, static_measurement, events, cell.get());
  if (seen == Seen::stopped) return stopped();
  if (const std::string why = why_nothing(seen, static_measurement); !why.empty()) {
    log_info(why);
    return kOff;
  }
  bool fine = print(judge(static_measurement.result()));
  if (options.mass_g) fine = by_mass(options, at, stop, static_measurement, events) && fine;
  if (board) fine = by_cell(options, at, stop, *board, *cell) && fine;
  if (termination_requested()) return stopped();
  return fine ? 0 : kOff;
}

void add_load_options(command_line::Command verb, CheckOptions& options) {
  const auto vector = [&](const char* name, std::vector<double>& value, const char* help) {
    return verb.add_option(name, value, help).delimiter(',').expected(3).check(finite());
  };
  auto mass = verb.add_option("--mass-g", options.mass_g, "a known mass to hang on, g")
                  .check(command_line::range(0.1, 1e5));
  auto at = vector("--at", options.at_mm,
                   "x,y,z: where a load takes hold, mm, platform frame (origin between the tags, "
                   "axes as the camera's)");
  vector("--gravity", options.gravity,
         "x,y,z: which way masses pull, camera axes; 0,0,-1 when the camera looks up");
  verb.add_option("--mass-sigma-percent", options.mass_sigma_percent,
                  "how well the mass is known, 1 standard deviation")
      .check(command_line::range(0.0, 50.0));
  verb.add_option("--at-sigma-mm", options.at_sigma_mm, "how well the point is known")
      .check(command_line::range(0.0, 50.0));
  auto board = verb.add_option("--board", options.board,
                               "a load cell of this board to push with: its port, or auto");
  auto direction = vector("--direction", options.direction,
                          "x,y,z: of the force on the platform when the cell is pushed");
  verb.add_option("--cells", options.cells,
                  "calibration file of its load cells; without it the one kept for this board")
      .needs(board);
  verb.add_option("--channel", options.channel, "of the load cell")
      .check(command_line::range(0, 3))
      .needs(board);
  verb.add_option("--emulated-cell", options.emulated_cell,
                  "with --source sim and an emulated board: the pipe that the board reads its "
                  "orders from, so that its cell feels the simulated hand")
      .needs(board);
  mass.needs(at);
  board.needs(at);
  board.needs(direction);
  direction.needs(board);
  mass.excludes(board);
}

struct ZeroCommandOptions {
  std::string sensor;  ///< path
  std::string source;  ///< SRC
  int events = -1;     ///< descriptor, see Events
};

std::string in_words(const Vector6& wrench) {
  return fmt::format("{:.4f} {:.4f} {:.4f} N, {:.3f} {:.3f} {:.3f} mN m", wrench[0], wrench[1],
                     wrench[2], wrench[3] * 1e3, wrench[4] * 1e3, wrench[5] * 1e3);
}

/// What stands in the way of a zero: a sensor that is not what was calibrated must not have its
/// fault taken off as if it were drift. Empty if nothing does.
std::string objection(const std::vector<InSituFinding>& findings) {
  for (const InSituFinding& f : findings) {
    switch (f.fault) {
      case Fault::tag_moved:
      case Fault::some_tag_moved:
      case Fault::tag_not_seen:
      case Fault::out_of_focus:
      case Fault::rest_elsewhere: return text(f);
      case Fault::not_known:
        if (f.subject == Subject::zero) return text(f);
        break;
      default: break;
    }
  }
  return {};
}

/// 0: written; 1: refused, nothing was written.
int set_zero(const ZeroCommandOptions& options) {
  const MeasuredSensor measured(options.sensor, "", {kMeasuredZero});
  const UniqueFd stop = termination_fd();
  BenchInput at =
      open_at_bench({options.sensor, options.source, true, WrenchCalibration::zero_that_fits});
  const SensorConfig& sensor = at.input.sensor;
  check_size(at.input);
  check_calibrated_rest(sensor, "zero");
  StaticMeasurement static_measurement(sensor);
  Events events(options.events);
  log_info("source: " + at.input.source->format().description);
  log_info("hands off for some seconds");
  const Seen seen = watch(*at.input.source, stop, static_measurement, events);
  if (seen == Seen::stopped) return stopped_unwritten();
  std::string why = why_nothing(seen, static_measurement);
  if (why.empty()) why = objection(judge(static_measurement.result()));
  if (!why.empty()) {
    log_info(why + "; nothing was written");
    return 1;
  }
  const Vector6 zero = static_measurement.result().wrench + sensor.zero.set;
  const std::filesystem::path file = measured.folder() / kMeasuredZero;
  write_measured(file, zero_yaml({stamp_for(options.sensor), zero,
                                  sha256_of(identity_of(sensor.camera, sensor.target, sensor.rest)),
                                  sha256_of(sensor.wrench)}));
  log_info("zero was {}{}", in_words(sensor.zero.set),
           sensor.zero.date.empty() ? "" : ", since " + sensor.zero.date);
  log_info(
      "zero is  {}, from {} frames in {:.1f} s; no thermometer is read: let it warm up before, and "
      "zero again after",
      in_words(zero), static_measurement.result().frames, static_measurement.seconds());
  log_info("written: " + file.string());
  return 0;
}

}  // namespace

void check_command(command_line::Command program) {
  const auto o = std::make_shared<CheckOptions>();
  auto verb = program.add_subcommand(
      "check", "say line by line whether a calibrated sensor still measures what it did");
  verb.add_option("--sensor", o->sensor, "sensor.yaml of this sensor").required();
  verb.add_option("--source", o->source,
                  source_forms({SourceKind::simulator, SourceKind::camera, SourceKind::images}))
      .required();
  add_events_option(verb, o->events);
  add_load_options(verb, *o);
  verb.runs([o] { return check(*o); });
}

void zero_command(command_line::Command program) {
  const auto o = std::make_shared<ZeroCommandOptions>();
  auto verb = program.add_subcommand("zero",
                                     "hands off: what the sensor reads now becomes its zero, "
                                     "written to measured/zero.yaml beside its sensor.yaml");
  verb.add_option("--sensor", o->sensor, "sensor.yaml of this sensor").required();
  verb.add_option("--source", o->source,
                  source_forms({SourceKind::simulator, SourceKind::camera, SourceKind::images}))
      .required();
  add_events_option(verb, o->events);
  verb.runs([o] { return set_zero(*o); });
}

}  // namespace tagwrench
