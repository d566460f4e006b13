#include "host/commands/static_measurement.h"

#include <fmt/format.h>

#include <cmath>

#include "host/app/input.h"
#include "host/calibration/light/control.h"
#include "host/core/axis_names.h"
#include "host/core/config_error.h"
#include "host/core/log.h"
#include "host/tracker/acquire.h"
#include "host/tracker/picture_quality.h"

namespace tagwrench {
namespace {

/// Scatter of a displacement that is always noise, and that never is: m and rad.
constexpr double kMinScatter = 0.3e-6, kMinTurn = 0.1e-3;
constexpr double kMaxScatter = 20e-6, kMaxTurn = 4e-3;
/// Of the frames that stood still, in how many a tag must have been held.
constexpr double kHeldFraction = 0.8;

StationarityDetector::Options scatter() {
  StationarityDetector::Options options;
  options.least << Eigen::Vector3d::Constant(kMinScatter), Eigen::Vector3d::Constant(kMinTurn);
  options.most << Eigen::Vector3d::Constant(kMaxScatter), Eigen::Vector3d::Constant(kMaxTurn);
  options.settled = std::chrono::milliseconds(500);
  return options;
}

/// As the tracker measures: about the platform's origin, along camera axes.
WrenchModel at_platform(WrenchModel model) {
  model.wrench_origin.setZero();
  model.camera_R_wrench_frame.setIdentity();
  return model;
}

TagPicture tag_picture(const ImageView& image, const SensorConfig& sensor) {
  Acquirer finder(sensor.camera, sensor.target);
  const LightReading light = read_light(image, sensor.camera.mirrored, finder.find(image).tags);
  return {light.white_counts, light.clipped_fraction, picture_quality(image).blur_px};
}

Vector6 sigma(const Track& track) { return track.covariance.diagonal().cwiseMax(0).cwiseSqrt(); }

constexpr const char* kAgain = "`tagwrench calibrate target`, then `tagwrench calibrate wrench`";

/// In the order of Subject.
constexpr const char* kSubjects[] = {"light", "focus", "tags", "residual", "zero", "scale"};

std::string moved(const Vector6& move) {
  return fmt::format("by {:.1f} um ({:+.1f} {:+.1f} {:+.1f}) and {:.1f} mrad",
                     move.head<3>().norm() * 1e6, move[0] * 1e6, move[1] * 1e6, move[2] * 1e6,
                     move.tail<3>().norm() * 1e3);
}

std::string fine(const InSituFinding& f) {
  switch (f.subject) {
    case Subject::light:
      return fmt::format("the tags' white is at {:.0f} of 255; {:.0f} when calibrated", f.amount,
                         f.expected);
    case Subject::focus:
      return fmt::format("the variance of the edges' blur has changed by {:+.2f} px^2", f.amount);
    case Subject::tags:
      return fmt::format("they agree to {:.1f} um and {:.1f} mrad", f.move.head<3>().norm() * 1e6,
                         f.move.tail<3>().norm() * 1e3);
    case Subject::residual:
      return fmt::format("{:.1f} % of the contrast is not explained by the picture at rest",
                         100 * f.amount);
    case Subject::zero:
      return fmt::format("reads {:+.2f} % of the range on {}", 100 * f.amount, kWrenchAxes[f.axis]);
    case Subject::scale:
      return fmt::format("measured / known = {:.4f} +/- {:.4f}", f.amount, f.sigma);
  }
  return "";
}

std::string not_known(Subject subject) {
  switch (subject) {
    case Subject::tags: return "one tag alone: nothing tells whether it has slipped";
    case Subject::zero:
      return "cannot be told: the tags disagree or are not held (see above), or no range is known";
    case Subject::scale: return "the load did not act long enough, or far too little";
    case Subject::light:
    case Subject::focus:
    case Subject::residual: break;
  }
  return "no tag is held: see the other lines";
}

std::string wrong(const InSituFinding& f) {
  switch (f.fault) {
    case Fault::too_dark:
      return fmt::format(
          "too dark: the tags' white is at {:.0f} of 255, at {:.0f} when calibrated: mend the "
          "light, or let `run --board` set it",
          f.amount, f.expected);
    case Fault::too_bright:
      return fmt::format(
          "too bright: {:.0f} % of the tags are clipped, {:.0f} % when calibrated: less light or a "
          "shorter exposure",
          100 * f.amount, 100 * f.expected);
    case Fault::out_of_focus:
      if (f.expected > 0) {
        return fmt::format(
            "out of focus: edges are blurred by {:.1f} px, by {:.1f} when calibrated: focus again; "
            "if it stays, {}",
            f.amount, f.expected, kAgain);
      }
      return fmt::format(
          "the lens has moved: the variance of the edges' blur has changed by {:+.2f} px^2: focus "
          "again; if it stays, {}",
          f.amount, kAgain);
    case Fault::tag_not_seen:
      return fmt::format(
          "tag {} is not held: is it covered, dirty, out of focus or loose? then check again",
          f.tag);
    case Fault::tag_moved:
      return fmt::format("tag {} has moved {} against the other: fix it, then {}", f.tag,
                         moved(f.move), kAgain);
    case Fault::some_tag_moved:
      return fmt::format("a tag has moved {} against another, perhaps tag {}: fix them, then {}",
                         moved(f.move), f.tag, kAgain);
    case Fault::residual_grown:
      return fmt::format(
          "{:.1f} % of tag {}'s contrast is not explained by the picture at rest (up to {:.0f} % "
          "is fine): clean tag and lens, look for glare; if it stays, {}",
          100 * f.amount, f.tag, 100 * f.expected, kAgain);
    case Fault::zero_drifted:
      return fmt::format("reads {:+.1f} % of the range on {} with hands off: `tagwrench zero`",
                         100 * f.amount, kWrenchAxes[f.axis]);
    case Fault::rest_elsewhere:
      return fmt::format(
          "reads {:+.0f} % of the range on {} with hands off, too far for drift: take off what "
          "lies on it; in another mounting, {}",
          100 * f.amount, kWrenchAxes[f.axis], kAgain);
    case Fault::scale_wrong:
      return fmt::format(
          "measured / known = {:.4f} +/- {:.4f}: `tagwrench calibrate wrench`, if the load is "
          "right",
          f.amount, f.sigma);
    case Fault::load_elsewhere:
      return fmt::format(
          "{:.0f} % of the range on {} is not what this load does (scale {:.3f}): check where it "
          "takes hold and which way it pulls (--at, --gravity, --direction); if they are right, "
          "`tagwrench calibrate wrench`",
          100 * f.expected, kWrenchAxes[f.axis], f.amount);
    case Fault::none:
    case Fault::not_known: break;
  }
  return "";
}

}  // namespace

bool rest_is_calibrated(const SensorConfig& sensor) {
  const bool placed = std::all_of(sensor.target.tags.begin(), sensor.target.tags.end(),
                                  [](const Tag& tag) { return tag.platform_T_tag.has_value(); });
  return placed && sensor.rest.camera_T_platform && sensor.rest.appearance;
}

void check_calibrated_rest(const SensorConfig& sensor, const std::string& verb) {
  if (rest_is_calibrated(sensor)) return;
  throw ConfigError(
      "--sensor: its rest is learned anew at every start, so `tagwrench {}` has nothing to compare "
      "with; run `tagwrench calibrate target` once, which writes measured/target.yaml with rest "
      "and places, and its picture; newtons are calibrated after it",
      verb);
}

StaticMeasurement::StaticMeasurement(const SensorConfig& sensor, Duration wanted, Duration patience)
    : sensor_(sensor),
      wanted_(wanted),
      patience_(patience),
      all_(make_tracker(sensor)),
      wrench_(at_platform(sensor.wrench)) {
  for (const Tag& tag : sensor.target.tags) {
    TargetDescription one = sensor.target;
    one.tags = {tag};
    alone_.push_back({.id = tag.id,
                      .centre = tag.platform_T_tag->translation(),
                      .tracker = std::make_unique<Tracker>(sensor.camera, one, sensor.rest),
                      .meter = StationarityDetector(scatter())});
  }
  std::vector<std::uint8_t> rest;
  rest.reserve(sensor.rest.appearance->level.size());
  for (const float level : sensor.rest.appearance->level)
    rest.push_back(static_cast<std::uint8_t>(std::clamp(std::lround(level), 0L, 255L)));
  const ReferenceImage& image = *sensor.rest.appearance;
  then_ = tag_picture({rest.data(), image.width, image.height, image.width}, sensor_);
}

void StaticMeasurement::wait_for_change(double least) {
  before_ = sum_.held > 0 ? (sum_.wrench / sum_.held).eval() : Vector6::Zero().eval();
  least_change_ = least;
  begin_.reset();
  moved_ = false;
  for (Alone& tag : alone_) tag.meter.reset();
  restart();
}

bool StaticMeasurement::changed(const Sample& sample) const {
  if (least_change_ == 0) return true;
  if (!carries_numbers(sample.status)) return false;
  const Vector6 share = (sample.wrench - before_).cwiseQuotient(sensor_.wrench.range);
  return share.cwiseAbs().maxCoeff() >= least_change_;
}

StaticMeasurement::Progress StaticMeasurement::add(const Frame& frame) {
  if (!begin_) begin_ = frame.capture_time;
  const Track& track = last_ = all_.track(frame);
  Sample sample{.capture_time = frame.capture_time};
  wrench_.estimate(track, sample);
  // Tag by tag: where they disagree, what they say together may jump. And where nothing is held,
  // nothing says that it moves.
  bool still = true;
  for (Alone& tag : alone_) {
    tag.last = tag.tracker->track(frame);
    if (tag.last.status != Status::ok) continue;
    tag.meter.add(frame.capture_time, tag.last.displacement, sigma(tag.last));
    still = still && tag.meter.still();
  }
  moved_ = !still;
  const bool late = frame.capture_time - *begin_ >= patience_;
  if (!still || !changed(sample)) {
    restart();
    if (late) note_picture(frame);
    return late ? Progress::gave_up : Progress::waiting;
  }
  if (!since_) since_ = frame.capture_time;
  counted_ = frame.capture_time - *since_;
  ++sum_.frames;
  if (carries_numbers(sample.status)) {
    ++sum_.held;
    sum_.wrench += sample.wrench;
    sum_.variance += sample.wrench_sigma.cwiseAbs2();
    sum_.displacement += track.displacement;
    sum_.residual_fraction += track.residual_fraction;
  }
  for (Alone& tag : alone_) {
    if (tag.last.status != Status::ok) continue;
    ++tag.sum.held;
    tag.sum.displacement += tag.last.displacement;
    tag.sum.covariance += tag.last.covariance;
    tag.sum.residual_fraction += tag.last.residual_fraction;
    tag.sum.blur_px2 += tag.last.blur_px2;
  }
  if (counted_ < wanted_) return late ? Progress::gave_up : Progress::waiting;
  note_picture(frame);
  return Progress::done;
}

void StaticMeasurement::note_picture(const Frame& frame) {
  now_ = tag_picture(frame.image, sensor_);
}

AtRest StaticMeasurement::result() const {
  AtRest rest;
  rest.frames = sum_.frames;
  rest.rest_frames = sensor_.rest.appearance->frames;
  for (const Alone& tag : alone_) {
    const double n = std::max(1, tag.sum.held);
    rest.tags.push_back({.id = tag.id,
                         .held = sum_.frames > 0 && tag.sum.held >= kHeldFraction * sum_.frames,
                         .centre = tag.centre,
                         .displacement = tag.sum.displacement / n,
                         .covariance = tag.sum.covariance / n,
                         .residual_fraction = tag.sum.residual_fraction / n,
                         .blur_px2 = tag.sum.blur_px2 / n});
  }
  rest.now = now_;
  rest.then = then_;
  rest.held = sum_.frames > 0 && sum_.held >= kHeldFraction * sum_.frames;
  rest.residual_fraction = sum_.residual_fraction / std::max(1, sum_.held);
  rest.wrench = sum_.wrench / std::max(1, sum_.held) - sensor_.zero.set;
  rest.range = sensor_.wrench.range;
  return rest;
}

Seen watch(FrameSource& source, const UniqueFd& stop, StaticMeasurement& static_measurement,
           Events& events, Output* board) {
  while (true) {
    Frame frame;
    const Next next = next_frame(source, stop, frame);
    if (board != nullptr) {
      if (const std::string_view news = board->service(); !news.empty()) log_info(news);
    }
    if (next == Next::stopped) return Seen::stopped;
    if (next == Next::end) return Seen::too_little;
    if (next != Next::frame) continue;
    const StaticMeasurement::Progress progress = static_measurement.add(frame);
    const Track& track = static_measurement.last_track();
    events.picture(frame.image, {track.corners.data(), track.corner_count});
    events.progress(static_measurement.part());
    if (events.on())
      events.live(fmt::format("{:.1f} s of standing still", static_measurement.seconds()));
    if (progress == StaticMeasurement::Progress::done) return Seen::enough;
    if (progress == StaticMeasurement::Progress::gave_up) return Seen::too_little;
  }
}

std::string why_nothing(Seen seen, const StaticMeasurement& static_measurement) {
  if (seen == Seen::enough) return {};
  if (static_measurement.moves())
    return "it never stood still: hands off, no wind, and no mass that swings";
  return static_measurement.result().frames > 0 ? ""
                                                : "too few frames: it takes 3 s with hands off";
}

std::string text(const InSituFinding& finding) {
  const bool unknown = finding.fault == Fault::not_known;
  return fmt::format("{:<7}{:<10}{}",
                     finding.fine() ? "fine"
                     : unknown      ? "?"
                                    : "OFF",
                     kSubjects[static_cast<int>(finding.subject)],
                     finding.fine() ? fine(finding)
                     : unknown      ? not_known(finding.subject)
                                    : wrong(finding));
}

}  // namespace tagwrench
