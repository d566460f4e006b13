#include "host/tracker/tracker.h"

#include <algorithm>
#include <exception>
#include <optional>

#include "host/core/config_error.h"
#include "host/tracker/acquire.h"
#include "host/tracker/corner_pose.h"
#include "host/tracker/diagnostics.h"
#include "host/tracker/geometry_uncertainty.h"
#include "host/tracker/photometric.h"
#include "host/tracker/predictor.h"
#include "host/tracker/reference.h"
#include "host/tracker/refine.h"
#include "host/tracker/shutter_check.h"
#include "host/tracker/tag_corners.h"
#include "host/tracker/trust.h"

namespace tagwrench {
namespace {

/// Around the place where the target is expected: a motion this large between frames is followed
/// without the whole frame, px.
constexpr int kMargin_px = 40;

/// Frames in a row that a loaded picture of the target may fail to fit before it is called wrong.
constexpr int kMisfits = 15;

/// Farther from a given rest pose than anybody seats a platform twice: m and rad; how long it
/// stands there; and how long it must stand near rest for rest to be right.
constexpr double kFar = 0.3e-3;
constexpr double kFarAngle = 0.026;
constexpr Duration kStillTime = std::chrono::milliseconds(1500);
constexpr Duration kSettling = std::chrono::milliseconds(200);

/// While the platform moves less than this it stands still, m and rad: more than the edges' noise.
/// Where more matters, as when its picture is learned, one looks closer.
constexpr double kStill = 15e-6;
constexpr double kStillAngle = 1e-3;

/// Covariance of the rotation vector r of exp(r), from that of a small rotation after it: the
/// inverse of the left Jacobian of SO(3) to second order (Sola, "A micro Lie theory", arXiv
/// 1812.01537, equation 146).
Matrix6 displacement_covariance(const Matrix6& motion, const Vector6& displacement) {
  const Eigen::Matrix3d r = cross_matrix(displacement.tail<3>());
  Matrix6 turn = Matrix6::Identity();
  turn.bottomRightCorner<3, 3>() = Eigen::Matrix3d::Identity() - 0.5 * r + r * r / 12.0;
  return turn * motion * turn.transpose();
}

PixelView<std::uint8_t> view(const ImageView& image) {
  return {image.pixels, image.width, image.height, image.stride};
}

}  // namespace

struct Tracker::State {
  State(const CameraModel& model, const TargetDescription& description,
        const ReferenceOptions& options)
      : camera(model),
        target(description),
        acquirer(model, description),
        refiner(model),
        learner(model, description, options, acquirer.patterns()),
        diagnostics(model, description) {
    rest.given = options.camera_T_platform.has_value();
    const bool placed = std::all_of(description.tags.begin(), description.tags.end(),
                                    [](const Tag& tag) { return tag.platform_T_tag.has_value(); });
    if (!placed || !rest.given) return;
    LearnedReference given;
    given.camera_T_platform = given.seen_from = *options.camera_T_platform;
    for (std::size_t t = 0; t < description.tags.size(); ++t) {
      const Tag& tag = description.tags[t];
      given.target.tags.push_back(make_edge_tag(acquirer.patterns()[t], *tag.platform_T_tag));
      given.tag_covariance.emplace_back(tag.sigma.cwiseAbs2().asDiagonal());
    }
    if (options.appearance) given.image = *options.appearance;
    appearance_loaded = options.appearance.has_value();
    adopt(given);
  }

  void adopt(const LearnedReference& learned) {
    rest.camera_T_platform = learned.camera_T_platform;
    refiner.set_target(learned.target);
    rest.platform_T_tag.clear();
    for (const EdgeTag& tag : learned.target.tags)
      rest.platform_T_tag.push_back(tag.platform_T_tag);
    predictor.start({}, rest.camera_T_platform);
    rest.known = true;
    const ReferenceImage& image = learned.image;
    if (image.level.empty() || image.width != camera.width_px || image.height != camera.height_px)
      return;
    aligner.set_template(
        make_pixel_template(camera, {image.level.data(), image.width, image.height, image.width},
                            std::max(1, image.frames), learned.noise, acquirer.patterns(),
                            learned.target, learned.seen_from, {}));
    pose_covariance = rest.given ? learned.pose_covariance : Matrix6::Zero();
    geometry.set(aligner, learned.seen_from, learned.tag_covariance, !rest.given);
    light = {};
  }

  bool readable(const ImageView& image) const {
    return image.pixels != nullptr && image.width == camera.width_px &&
           image.height == camera.height_px && image.stride >= image.width;
  }

  Diagnostic flip_diagnostic() const {
    return camera.mirrored ? Diagnostic::image_looks_unmirrored : Diagnostic::image_looks_mirrored;
  }

  void find(const Frame& frame, Track& track);
  Track learn(const Frame& frame);
  Track follow(const Frame& frame) noexcept;
  void learn_picture(const Frame& frame);
  Refinement find_near(const Frame& frame) noexcept;
  Refinement find_anywhere(const Frame& frame, Track& track) noexcept;
  PhotometricFit finish(const Frame& frame, const Refinement& edges) noexcept;
  bool accepted(const PhotometricFit& fit) const noexcept;
  Refinement reacquire(const Frame& frame, Track& track);
  Refinement refine_within_reach(const Frame& frame, const Eigen::Isometry3d& start) noexcept;
  PhotometricFit align(const Frame& frame, const Eigen::Isometry3d& start) noexcept;
  Region region(TimePoint time) const noexcept;
  void say_misfit(bool fits, Track& track) noexcept;
  void say_far_from_rest(TimePoint time, Track& track) noexcept;
  void say_shutter(const Frame& frame, const Eigen::Isometry3d& pose, Track& track) noexcept;
  void check_geometry(const Frame& frame, Track& track);
  void explain(const Frame& frame, Track& track) noexcept;

  CameraModel camera;
  TargetDescription target;
  Acquirer acquirer;
  Refiner refiner;
  ReferenceEstimator learner;
  TrackingDiagnostics diagnostics;
  ShutterCheck shutter;
  Finding finding;        ///< the last one
  bool searched = false;  ///< it is of this frame
  bool learning = false;  ///< this frame counted for rest
  bool appearance_loaded = false;
  KnownReference rest;
  bool had_target = false;
  bool holding = false;
  int misfits = 0;
  bool geometry_checked = false;
  bool far_from_rest_told = false;       ///< or known to be untrue
  std::optional<TimePoint> still_since;  ///< only while that is open
  Vector6 still_at = Vector6::Zero();    ///< m, rad, from rest
  bool still_by_picture = false;         ///< not by edges, which lie a little elsewhere
  ConstantVelocityPredictor predictor;
  PhotometricAligner aligner;
  PhotometricState light;
  GeometryUncertainty geometry;
  Matrix6 pose_covariance = Matrix6::Zero();  ///< of the picture's place against a given rest
};

void Tracker::State::find(const Frame& frame, Track& track) {
  finding = acquirer.find(frame.image);
  searched = finding.looked;
  if (finding.other_way_round) track.diagnostic = flip_diagnostic();
}

Track Tracker::State::learn(const Frame& frame) {
  Track track;
  if (learner.wants_finding()) find(frame, track);
  const ReferenceEstimator::Progress progress = learner.add(frame.image, finding);
  learning = progress == ReferenceEstimator::Progress::learning;
  track.tags_held = static_cast<std::uint8_t>(learner.tags_seen());
  if (progress == ReferenceEstimator::Progress::moved)
    track.diagnostic = Diagnostic::moved_while_learning;
  if (progress == ReferenceEstimator::Progress::done) {
    adopt(learner.learned());
    had_target = holding = true;
    predictor.start(frame.capture_time, rest.camera_T_platform);
    track.diagnostic = Diagnostic::rest_learned;
  }
  return track;
}

/// Where rest and placement are given but no picture is, one is taken as soon as the platform
/// stands still, wherever that is.
void Tracker::State::learn_picture(const Frame& frame) {
  finding = learner.wants_finding() ? acquirer.find(frame.image) : Finding{};
  if (learner.add(frame.image, finding) != ReferenceEstimator::Progress::done) return;
  const Eigen::Isometry3d now = predictor.last();
  adopt(learner.learned());
  predictor.start(frame.capture_time, now);
}

Refinement Tracker::State::refine_within_reach(const Frame& frame,
                                               const Eigen::Isometry3d& start) noexcept {
  Refinement fit = refiner.refine(view(frame.image), start);
  if (fit.verdict != Verdict::lost && !within_reach(rest.camera_T_platform, fit.camera_T_platform))
    fit = {};
  return fit;
}

Refinement Tracker::State::reacquire(const Frame& frame, Track& track) {
  find(frame, track);
  if (finding.tags.empty()) return {};
  const std::optional<Eigen::Isometry3d> start = pose_from_corners(
      camera, target.tag_size, finding.tags, rest.platform_T_tag, rest.camera_T_platform);
  if (!start) return {};
  return refine_within_reach(frame, *start);
}

/// The edges find a target that is further away than alignment reaches.
Refinement Tracker::State::find_near(const Frame& frame) noexcept {
  if (!holding) return {};
  const Refinement fit = refine_within_reach(frame, predictor.predict(frame.capture_time));
  // A motion that stops dead is nearer to where it was than to where it was going.
  return fit.verdict != Verdict::lost ? fit : refine_within_reach(frame, predictor.last());
}

Refinement Tracker::State::find_anywhere(const Frame& frame, Track& track) noexcept {
  try {
    return reacquire(frame, track);
  } catch (const std::exception&) {
    return {};  // out of memory: try again with the next frame
  }
}

/// From what the edges found to the pose that counts.
PhotometricFit Tracker::State::finish(const Frame& frame, const Refinement& edges) noexcept {
  if (aligner.ready()) return align(frame, edges.camera_T_platform);
  PhotometricFit fit;
  fit.camera_T_platform = edges.camera_T_platform;
  fit.covariance = edges.covariance;
  fit.tags_held = edges.tags_held;
  fit.converged = edges.verdict == Verdict::held;
  return fit;
}

bool Tracker::State::accepted(const PhotometricFit& fit) const noexcept {
  return fit.converged && (!aligner.ready() || trusted(fit, light));
}

PhotometricFit Tracker::State::align(const Frame& frame, const Eigen::Isometry3d& start) noexcept {
  const Region part = frame.readable();
  const PixelWindow window{frame.image.pixels,  frame.image.stride,  part.x, part.y,
                           part.x + part.width, part.y + part.height};
  PhotometricFit fit =
      aligner.align(window, start, predictor.velocity(frame.capture_time, start), light);
  if (fit.converged && camera.readout > 0) {
    fit = aligner.align(window, fit.camera_T_platform,
                        predictor.velocity(frame.capture_time, fit.camera_T_platform), light);
  }
  if (fit.converged && !within_reach(rest.camera_T_platform, fit.camera_T_platform))
    fit.converged = false;
  return fit;
}

/// What the next frame must show, supposing that it comes after the same time as this one.
Region Tracker::State::region(TimePoint time) const noexcept {
  return aligner.region(predictor.predict(time + predictor.period()), kMargin_px);
}

/// Once, when a picture of the target that was loaded does not show what the camera sees.
void Tracker::State::say_misfit(bool fits, Track& track) noexcept {
  if (!appearance_loaded) return;
  misfits = fits ? 0 : misfits + 1;
  if (misfits >= kMisfits && track.diagnostic == Diagnostic::none)
    track.diagnostic = Diagnostic::appearance_does_not_fit;
}

/// Once, when the target has stood still, but not where rest was given; never after it was seen
/// there.
void Tracker::State::say_far_from_rest(TimePoint time, Track& track) noexcept {
  if (far_from_rest_told || !rest.given) return;
  const Vector6& offset = track.displacement;
  const Vector6 moved_on = offset - still_at;
  if (!still_since || still_by_picture != aligner.ready() || moved_on.head<3>().norm() > kStill ||
      moved_on.tail<3>().norm() > kStillAngle) {
    still_since = time;
    still_at = offset;
    still_by_picture = aligner.ready();
  }
  if (time - *still_since < kSettling) return;
  const bool far = offset.head<3>().norm() > kFar || offset.tail<3>().norm() > kFarAngle;
  if (far && time - *still_since < kStillTime) return;
  far_from_rest_told = true;
  if (!far) return;
  track.diagnostic = Diagnostic::far_from_rest;
  track.details.offset = offset;
  track.details.rest_given = true;
}

/// Once, when doubted pictures of a moving target turn out to be sheared.
void Tracker::State::say_shutter(const Frame& frame, const Eigen::Isometry3d& pose,
                                 Track& track) noexcept {
  if (camera.readout > 0 || !aligner.ready()) return;
  const PixelWindow window{frame.image.pixels, frame.image.stride, 0, 0,
                           frame.image.width,  frame.image.height};
  if (shutter.rolls(aligner, window, frame.capture_time, pose, light) &&
      track.diagnostic == Diagnostic::none) {
    track.diagnostic = Diagnostic::shutter_rolls;
  }
}

/// Once, as soon as the target is held: tags of the wrong size, or in other places than described,
/// may be held, but what is measured is wrong.
void Tracker::State::check_geometry(const Frame& frame, Track& track) {
  if (geometry_checked) return;
  geometry_checked = true;
  if (finding.tags.size() != target.tags.size()) return;
  const Diagnosis diagnosis = diagnose(camera, target, rest, frame.image, finding);
  if (diagnosis.cause != Diagnostic::other_scale && diagnosis.cause != Diagnostic::other_places)
    return;
  far_from_rest_told = true;  // a wrong scale looks like a wrong distance
  track.diagnostic = diagnosis.cause;
  track.details = diagnosis.details;
}

/// Why there are no numbers, now and then.
void Tracker::State::explain(const Frame& frame, Track& track) noexcept {
  if (track.status == Status::ok || learning) {
    diagnostics.held();
    if (!learning && track.diagnostic == Diagnostic::none) check_geometry(frame, track);
    return;
  }
  if (!searched || track.needs_whole_frame || track.diagnostic != Diagnostic::none) return;
  const Diagnosis diagnosis = diagnostics.not_held(frame.capture_time, rest, frame.image, finding);
  track.diagnostic = diagnosis.cause;
  track.details = diagnosis.details;
}

Track Tracker::State::follow(const Frame& frame) noexcept {
  Track track;
  track.status = had_target ? Status::lost : Status::acquiring;
  const Region whole{0, 0, frame.image.width, frame.image.height};
  const bool partial = !frame.readable().contains(whole);

  PhotometricFit fit;
  if (holding && aligner.ready()) fit = align(frame, predictor.predict(frame.capture_time));
  bool followed = holding;
  Refinement edges;
  if (!accepted(fit)) {
    if (partial) {
      track.needs_whole_frame = true;
      return track;
    }
    edges = find_near(frame);
    if (edges.verdict != Verdict::lost) fit = finish(frame, edges);
    if (edges.verdict == Verdict::lost || !accepted(fit)) {
      const Refinement anew = find_anywhere(frame, track);
      if (anew.verdict != Verdict::lost) {
        edges = anew;
        fit = finish(frame, edges);
        followed = false;
      }
    }
    holding = edges.verdict != Verdict::lost;
    if (!holding) {
      light = {};
      shutter.lost();
      return track;
    }
  }
  holding = had_target = true;
  const bool good = accepted(fit);
  const Eigen::Isometry3d& pose = fit.converged ? fit.camera_T_platform : edges.camera_T_platform;
  if (!good) say_shutter(frame, pose, track);
  shutter.seen(frame.capture_time, pose);
  if (followed) {
    predictor.add(frame.capture_time, pose);
  } else {
    predictor.start(frame.capture_time, pose);
  }
  track.tags_held = fit.converged ? fit.tags_held : edges.tags_held;
  track.residual_px = edges.residual_px;
  if (fit.converged) {
    track.residual_fraction = fit.residual_fraction;
    track.blur_px2 = 2 * light.blur[0];
  }
  track.status = Status::doubtful;
  set_corners(camera, target, rest.platform_T_tag, pose, track);
  say_misfit(good, track);
  if (!good) return track;
  track.status = Status::ok;
  track.displacement = motion_between(rest.camera_T_platform, pose);
  track.covariance = displacement_covariance(fit.covariance, track.displacement) +
                     geometry.covariance(track.displacement) + pose_covariance;
  say_far_from_rest(frame.capture_time, track);
  if (aligner.ready()) track.wanted = region(frame.capture_time);
  if (!aligner.ready() && predictor.step().head<3>().norm() < kStill &&
      predictor.step().tail<3>().norm() < kStillAngle) {
    try {
      learn_picture(frame);
    } catch (const std::exception&) {
      return track;  // out of memory: edges alone will do
    }
  }
  return track;
}

Tracker::Tracker(const CameraModel& camera, const TargetDescription& target,
                 const ReferenceOptions& rest)
    : state_(std::make_unique<State>(camera, target, rest)) {}

Tracker::~Tracker() = default;

const KnownReference& Tracker::rest() const noexcept { return state_->rest; }

Track Tracker::track(const Frame& frame) noexcept {
  if (!state_->readable(frame.image)) {
    state_->holding = false;
    Track absent;
    absent.status = state_->had_target ? Status::lost : Status::acquiring;
    return absent;
  }
  state_->searched = state_->learning = false;
  Track track;
  try {
    track = state_->rest.known ? state_->follow(frame) : state_->learn(frame);
  } catch (const std::exception&) {
    return {};  // out of memory: try again with the next frame
  }
  state_->explain(frame, track);
  return track;
}

}  // namespace tagwrench
