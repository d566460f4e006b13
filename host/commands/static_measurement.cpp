#include "host/commands/static_measurement.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "host/app/input.h"
#include "host/calibration/light/control.h"
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

}  // namespace

bool rest_is_calibrated(const SensorConfig& sensor) {
  const bool placed = std::all_of(sensor.target.tags.begin(), sensor.target.tags.end(),
                                  [](const Tag& tag) { return tag.platform_T_tag.has_value(); });
  return placed && sensor.rest.camera_T_platform && sensor.rest.appearance;
}

void check_calibrated_rest(const SensorConfig& sensor, const std::string& verb) {
  if (rest_is_calibrated(sensor)) return;
  throw ConfigError(fmt::format(
      "--sensor: its rest is learned anew at every start, so `tagwrench {}` has nothing to compare "
      "with; run `tagwrench calibrate target` once, which writes measured/target.yaml with rest "
      "and "
      "places, and its picture; newtons are calibrated after it",
      verb));
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

void StaticMeasurement::restart() {
  since_.reset();
  counted_ = {};
  frames_ = held_ = 0;
  wrench_sum_.setZero();
  variance_sum_.setZero();
  displacement_sum_.setZero();
  residual_sum_ = 0;
  for (Alone& tag : alone_) {
    tag.held = 0;
    tag.displacement.setZero();
    tag.covariance.setZero();
    tag.residual_fraction = tag.blur_px2 = 0;
  }
}

void StaticMeasurement::wait_for_change(double least) {
  before_ = held_ > 0 ? (wrench_sum_ / held_).eval() : Vector6::Zero().eval();
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
  ++frames_;
  if (carries_numbers(sample.status)) {
    ++held_;
    wrench_sum_ += sample.wrench;
    variance_sum_ += sample.wrench_sigma.cwiseAbs2();
    displacement_sum_ += track.displacement;
    residual_sum_ += track.residual_fraction;
  }
  for (Alone& tag : alone_) {
    if (tag.last.status != Status::ok) continue;
    ++tag.held;
    tag.displacement += tag.last.displacement;
    tag.covariance += tag.last.covariance;
    tag.residual_fraction += tag.last.residual_fraction;
    tag.blur_px2 += tag.last.blur_px2;
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
  rest.frames = frames_;
  rest.rest_frames = sensor_.rest.appearance->frames;
  for (const Alone& tag : alone_) {
    const double n = std::max(1, tag.held);
    rest.tags.push_back({.id = tag.id,
                         .held = frames_ > 0 && tag.held >= kHeldFraction * frames_,
                         .centre = tag.centre,
                         .displacement = tag.displacement / n,
                         .covariance = tag.covariance / n,
                         .residual_fraction = tag.residual_fraction / n,
                         .blur_px2 = tag.blur_px2 / n});
  }
  rest.now = now_;
  rest.then = then_;
  rest.held = frames_ > 0 && held_ >= kHeldFraction * frames_;
  rest.residual_fraction = residual_sum_ / std::max(1, held_);
  rest.wrench = wrench_sum_ / std::max(1, held_) - sensor_.zero.set;
  rest.range = sensor_.wrench.range;
  return rest;
}

Vector6 StaticMeasurement::wrench_sigma() const {
  return (variance_sum_ / std::max(1, held_)).cwiseSqrt();
}

Vector6 StaticMeasurement::displacement() const { return displacement_sum_ / std::max(1, held_); }

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

}  // namespace tagwrench
