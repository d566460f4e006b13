// `tagwrench calibrate`, the verb above those that measure; and of these `target`: the platform at
// rest, then moved about, in; where the tags sit and what they look like, in the folder measured/
// beside sensor.yaml, out.

#include <chrono>
#include <filesystem>
#include <limits>

#include "host/app/input.h"
#include "host/calibration/target/recorder.h"
#include "host/commands/commands.h"
#include "host/commands/measuring.h"
#include "host/core/log.h"
#include "host/core/os/termination.h"
#include "host/sensor/measured_files.h"
#include "host/tracker/rotation.h"
#include "host/tracker/tracker.h"

namespace tagwrench {
namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;

constexpr std::size_t kMaxKeyframes = 150;
constexpr double kSecondsFromCamera = 30;
constexpr Duration kAdviseEvery = std::chrono::seconds(2);

struct CalibrateTargetOptions {
  std::string sensor;             ///< path
  std::string source;             ///< SRC
  std::string out;                ///< path of a new sensor.yaml to measure for; empty: `sensor`
  std::optional<long> frames;     ///< use no more than this, the rest included
  std::optional<double> seconds;  ///< alike, by the frames' own time
  int events = -1;                ///< descriptor, see Events
  bool despite_damage = false;
};

/// Says what to do, and every two seconds how far it is.
class MotionGuide {
 public:
  void say(const TargetRecorder& record, const Track& track) {
    if (track.diagnostic == Diagnostic::moved_while_learning)
      log_info("the platform moved: hands off until the rest is learned");
    if (is_trouble(track.diagnostic)) log_info(diagnostic_text(track.diagnostic, track.details));
    if (record.rest_known() && !told_to_move_) {
      told_to_move_ = true;
      log_info("rest learned; now tilt and push the platform slowly, every way");
    }
    if (Clock::now() - said_ < kAdviseEvery) return;
    said_ = Clock::now();
    if (!record.rest_known()) {
      log_info("{} frames; waiting for all tags, at rest", record.counts().frames);
      return;
    }
    const Vector6 range = record.range();
    log_info(
        "{} frames, {} different pictures; x {:.2f} y {:.2f} z {:.2f} mm, about x {:.1f} y {:.1f} "
        "z {:.1f} degrees{}",
        record.counts().frames, record.keyframes().size(), range[0] * 1e3, range[1] * 1e3,
        range[2] * 1e3, range[3] * 57.29578, range[4] * 57.29578, range[5] * 57.29578,
        track.status == Status::ok ? "" : "; the tags are not held");
  }

 private:
  bool told_to_move_ = false;
  TimePoint said_ = Clock::now();
};

/// Of the time of a calibration, seeing takes the first part, the adjustment the rest.
constexpr double kSeeingFraction = 0.7;

void tell_events(Events& events, const TargetRecorder& record, const Track& track,
                 const Frame& frame, double part) {
  if (!events.on()) return;
  events.progress(kSeeingFraction * std::min(1.0, part));
  events.picture(frame.image, {track.corners.data(), track.corner_count});
  if (!record.rest_known()) {
    events.live("hands off: the rest is learned");
    return;
  }
  const Vector6 range = record.range();
  events.coverage({{"range", std::vector<double>(range.begin(), range.end())},
                   {"keyframes", record.keyframes().size()},
                   {"wanted", kMinKeyframes}});
  events.live(track.status == Status::ok ? "tilt and push the platform slowly, every way"
                                         : "the tags are not held");
}

/// Until the source ends, enough was seen (true) or a signal came (false).
bool watch(FrameSource& source, const CalibrateTargetOptions& options, const UniqueFd& stop,
           TargetRecorder& record, Events& events) {
  const bool ends = parse_source(options.source).is(SourceKind::images);
  const double seconds = options.seconds.value_or(
      ends || options.frames ? std::numeric_limits<double>::infinity() : kSecondsFromCamera);
  std::optional<TimePoint> first;
  MotionGuide guide;
  while (!options.frames || record.counts().frames < *options.frames) {
    Frame frame;
    const Next next = next_frame(source, stop, frame);
    if (next == Next::stopped) return false;
    if (next == Next::end) break;
    if (next != Next::frame) continue;
    if (!first) first = frame.capture_time;
    const double elapsed = std::chrono::duration<double>(frame.capture_time - *first).count();
    if (elapsed >= seconds) break;
    const Track track = record.add(frame);
    guide.say(record, track);
    tell_events(events, record, track, frame, elapsed / seconds);
  }
  if (const std::string bad = source.unusable(); !bad.empty()) log_info(bad);
  return true;
}

TargetFile found(const fs::path& sensor_file, const SensorConfig& sensor,
                 const TargetEstimate& estimate) {
  TargetFile out;
  out.stamp = stamp_for(sensor_file);
  out.target = calibrated_target(sensor.target, estimate);
  out.rest = midpoint_frame(estimate.camera_T_tag);
  out.camera_sha256 = sha256_of(sensor.camera);
  if (readout_is_clear(estimate)) out.readout = estimate.readout;
  return out;
}

/// Throws ConfigError if it cannot start, or if the recording cannot show where the tags sit; then
/// nothing has been written.
int calibrate_target(const CalibrateTargetOptions& options) {
  const MeasuredSensor measured(options.sensor, options.out,
                                {kMeasuredTarget, kMeasuredPicture, kMeasuredZero});
  const UniqueFd stop = termination_fd();
  const record::IfDamaged damaged = if_damaged(options.despite_damage);
  const Input input = open_input(
      {options.sensor, options.source, true, WrenchCalibration::without_target, damaged});
  check_size(input);
  const SensorConfig& sensor = input.sensor;
  Events events(options.events);
  TargetRecorder record(sensor.camera, sensor.target, sensor.rest, kMaxKeyframes);
  log_info("source: " + input.source->format().description);
  log_info("hands off until {} frames at rest are taken", sensor.rest.frames);
  if (!watch(*input.source, options, stop, record, events)) return stopped_unwritten();
  check_whole(*input.source, damaged);
  check_record(record, sensor.target, sensor.rest);

  log_info("adjusting to {} pictures", record.keyframes().size());
  TimePoint said = Clock::now();
  const TargetEstimate estimate =
      adjust_target(record.at_rest(), record.keyframes(), [&](double share) {
        events.progress(kSeeingFraction + (1 - kSeeingFraction) * share);
        if (Clock::now() - said >= kAdviseEvery) {
          said = Clock::now();
          log_info("{:.0f} %", 100 * share);
        }
        return !termination_requested();
      });
  if (termination_requested()) return stopped_unwritten();
  check_estimate(estimate, sensor.target, sensor.camera);
  measured.make({kMeasuredCamera});
  write_measured_target(measured.folder(), found(measured.sensor(), sensor, estimate),
                        record.at_rest().image);
  void_zero(measured.sensor());
  for (const std::string& line : describe(record, estimate, sensor.target, sensor.camera))
    log_info(line);
  if (readout_is_clear(estimate)) log_info("the shutter rolls: readout_ms is written too");
  log_info("written: {} and {}", (measured.folder() / kMeasuredTarget).string(),
           (measured.folder() / kMeasuredPicture).string());
  if (!sensor.calibration.empty() || is_measured(measured.folder(), kMeasuredWrench))
    log_info(
        "the calibration in newtons was made with the target as it was; run `tagwrench calibrate "
        "wrench` again");
  return 0;
}

}  // namespace

void calibrate_target_command(command_line::Command family) {
  const auto o = std::make_shared<CalibrateTargetOptions>();
  auto verb = family.add_subcommand(
      "target", "where the tags sit, from the platform at rest and then moved about");
  verb.add_option("--sensor", o->sensor, "sensor.yaml of this sensor").required();
  verb.add_option("--source", o->source,
                  source_forms({SourceKind::simulator, SourceKind::camera, SourceKind::images}))
      .required();
  verb.add_option("--out", o->out,
                  "a new sensor.yaml to make, in another folder; what is found goes into measured/ "
                  "beside it, without --out beside --sensor");
  verb.add_flag(kDespiteDamage, o->despite_damage, kDespiteDamageHelp);
  verb.add_option("--frames", o->frames, "use no more than N frames")
      .check(command_line::range(1, 2'000'000'000));
  verb.add_option(
          "--seconds", o->seconds,
          "use no more than S seconds; without it a folder is used up and anything else for 30 s")
      .check(calibration_seconds());
  add_events_option(verb, o->events);
  verb.runs([o] { return calibrate_target(*o); });
}

void calibrate_command(command_line::Command program) {
  auto verb =
      program.add_subcommand("calibrate", "measure this sensor and write it to its sensor.yaml");
  verb.require_subcommand();
  calibrate_camera_command(verb);
  calibrate_target_command(verb);
  calibrate_wrench_command(verb);
}

}  // namespace tagwrench
