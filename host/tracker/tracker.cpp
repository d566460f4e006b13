#include "host/tracker/tracker.h"

#include <algorithm>
#include <exception>
#include <optional>

#include "host/config_error.h"
#include "host/tracker/acquire.h"
#include "host/tracker/corner_pose.h"
#include "host/tracker/geometry_uncertainty.h"
#include "host/tracker/motion.h"
#include "host/tracker/photometric.h"
#include "host/tracker/refine.h"
#include "host/tracker/rest.h"

namespace tagwrench {
namespace {

/// A fit that believes less of the template than this is doubted.
constexpr double kLeastGood = 0.3;
/// As is one that leaves residuals of this part of the contrast, or that needs a blur beyond what
/// its expansion describes, px^2.
constexpr double kMostResidualPart = 0.10;
constexpr double kMostBlur = 1.2;
/// Standard deviations beyond these are of no use for a force: m, rad.
constexpr double kDoubtTranslation = 0.3e-3;
constexpr double kDoubtRotation = 0.03;

/// Around the place where the target is expected: a motion this large between frames is followed
/// without the whole frame, px.
constexpr int kMargin_px = 40;

/// Frames in a row that a loaded picture of the target may fail to fit before it is called wrong.
constexpr int kMisfits = 15;

/// While the platform moves less than this per frame, its picture may be learned, m and rad.
constexpr double kStill = 3e-6;
constexpr double kStillAngle = 0.3e-3;

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

bool trusted(const PhotometricFit& fit, const PhotometricState& state) {
  const Vector6 sigma = fit.covariance.diagonal().cwiseMax(0.0).cwiseSqrt();
  return fit.good >= kLeastGood && fit.residual_part < kMostResidualPart &&
         std::abs(state.blur[0]) < kMostBlur && sigma.head<3>().maxCoeff() < kDoubtTranslation &&
         sigma.tail<3>().maxCoeff() < kDoubtRotation;
}

}  // namespace

struct Tracker::State {
  State(const CameraModel& model, const TargetDescription& description, const RestOptions& options)
      : camera(model),
        tag_size(description.tag_size),
        rest_given(options.camera_T_platform.has_value()),
        acquirer(model, description),
        refiner(model),
        learner(model, description, options, acquirer.patterns()) {
    const bool placed = std::all_of(description.tags.begin(), description.tags.end(),
                                    [](const Tag& tag) { return tag.platform_T_tag.has_value(); });
    if (!placed || !rest_given) return;
    LearnedRest given;
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

  void adopt(const LearnedRest& learned) {
    rest = learned.camera_T_platform;
    refiner.set_target(learned.target);
    platform_T_tag.clear();
    for (const EdgeTag& tag : learned.target.tags) platform_T_tag.push_back(tag.platform_T_tag);
    motion.start({}, rest);
    rest_known = true;
    const RestImage& image = learned.image;
    if (image.level.empty() || image.width != camera.width_px || image.height != camera.height_px)
      return;
    aligner.set_template(
        make_pixel_template(camera, {image.level.data(), image.width, image.height, image.width},
                            std::max(1, image.frames), learned.noise, acquirer.patterns(),
                            learned.target, learned.seen_from, {}));
    pose_covariance = rest_given ? learned.pose_covariance : Matrix6::Zero();
    geometry.set(aligner, learned.seen_from, learned.tag_covariance, !rest_given);
    light = {};
  }

  bool readable(const ImageView& image) const {
    return image.pixels != nullptr && image.width == camera.width_px &&
           image.height == camera.height_px && image.stride >= image.width;
  }

  Hint flip_hint() const {
    return camera.mirrored ? Hint::image_looks_unmirrored : Hint::image_looks_mirrored;
  }

  Track learn(const Frame& frame);
  Track follow(const Frame& frame) noexcept;
  void learn_picture(const Frame& frame);
  Refinement find_near(const Frame& frame) noexcept;
  Refinement find_anywhere(const Frame& frame, Track& track) noexcept;
  PhotometricFit finish(const Frame& frame, const Refinement& edges) noexcept;
  bool believed(const PhotometricFit& fit) const noexcept;
  Refinement reacquire(const Frame& frame, Track& track);
  Refinement refine_within_reach(const Frame& frame, const Eigen::Isometry3d& start) noexcept;
  PhotometricFit align(const Frame& frame, const Eigen::Isometry3d& start) noexcept;
  Region region(TimePoint time) const noexcept;
  void say_misfit(bool fits, Track& track) noexcept;

  CameraModel camera;
  double tag_size;
  bool rest_given;
  Acquirer acquirer;
  Refiner refiner;
  RestLearner learner;
  bool rest_known = false;
  bool appearance_loaded = false;
  Eigen::Isometry3d rest = Eigen::Isometry3d::Identity();
  std::vector<Eigen::Isometry3d> platform_T_tag;
  bool had_target = false;
  bool holding = false;
  int misfits = 0;
  Motion motion;
  PhotometricAligner aligner;
  PhotometricState light;
  GeometryUncertainty geometry;
  Matrix6 pose_covariance = Matrix6::Zero();  ///< of the picture's place against a given rest
};

Track Tracker::State::learn(const Frame& frame) {
  Track track;
  const Finding finding = learner.wants_finding() ? acquirer.find(frame.image) : Finding{};
  if (finding.other_way_round) track.hint = flip_hint();
  const RestLearner::Progress progress = learner.add(frame.image, finding);
  track.tags_held = static_cast<std::uint8_t>(learner.tags_seen());
  if (progress == RestLearner::Progress::moved) track.hint = Hint::moved_while_learning;
  if (progress == RestLearner::Progress::done) {
    adopt(learner.learned());
    had_target = holding = true;
    motion.start(frame.capture_time, rest);
    track.hint = Hint::rest_learned;
  }
  return track;
}

/// Where rest and placement are given but no picture is, one is taken as soon as the platform
/// stands still, wherever that is.
void Tracker::State::learn_picture(const Frame& frame) {
  const Finding finding = learner.wants_finding() ? acquirer.find(frame.image) : Finding{};
  if (learner.add(frame.image, finding) != RestLearner::Progress::done) return;
  const Eigen::Isometry3d now = motion.last();
  adopt(learner.learned());
  motion.start(frame.capture_time, now);
}

Refinement Tracker::State::refine_within_reach(const Frame& frame,
                                               const Eigen::Isometry3d& start) noexcept {
  Refinement fit = refiner.refine(view(frame.image), start);
  if (fit.verdict != Verdict::lost && !within_reach(rest, fit.camera_T_platform)) fit = {};
  return fit;
}

Refinement Tracker::State::reacquire(const Frame& frame, Track& track) {
  const Finding finding = acquirer.find(frame.image);
  if (finding.other_way_round) track.hint = flip_hint();
  if (finding.tags.empty()) return {};
  const std::optional<Eigen::Isometry3d> start =
      pose_from_corners(camera, tag_size, finding.tags, platform_T_tag, rest);
  if (!start) return {};
  return refine_within_reach(frame, *start);
}

/// The edges find a target that is further away than alignment reaches.
Refinement Tracker::State::find_near(const Frame& frame) noexcept {
  if (!holding) return {};
  const Refinement fit = refine_within_reach(frame, motion.predict(frame.capture_time));
  // A motion that stops dead is nearer to where it was than to where it was going.
  return fit.verdict != Verdict::lost ? fit : refine_within_reach(frame, motion.last());
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

bool Tracker::State::believed(const PhotometricFit& fit) const noexcept {
  return fit.converged && (!aligner.ready() || trusted(fit, light));
}

PhotometricFit Tracker::State::align(const Frame& frame, const Eigen::Isometry3d& start) noexcept {
  const Region part = frame.readable();
  const PixelWindow window{frame.image.pixels,  frame.image.stride,  part.x, part.y,
                           part.x + part.width, part.y + part.height};
  PhotometricFit fit =
      aligner.align(window, start, motion.velocity(frame.capture_time, start), light);
  if (fit.converged && camera.readout > 0) {
    fit = aligner.align(window, fit.camera_T_platform,
                        motion.velocity(frame.capture_time, fit.camera_T_platform), light);
  }
  if (fit.converged && !within_reach(rest, fit.camera_T_platform)) fit.converged = false;
  return fit;
}

/// What the next frame must show, supposing that it comes after the same time as this one.
Region Tracker::State::region(TimePoint time) const noexcept {
  return aligner.region(motion.predict(time + motion.period()), kMargin_px);
}

/// Once, when a picture of the target that was loaded does not show what the camera sees.
void Tracker::State::say_misfit(bool fits, Track& track) noexcept {
  if (!appearance_loaded) return;
  misfits = fits ? 0 : misfits + 1;
  if (misfits >= kMisfits && track.hint == Hint::none) track.hint = Hint::appearance_does_not_fit;
}

Track Tracker::State::follow(const Frame& frame) noexcept {
  Track track;
  track.status = had_target ? Status::lost : Status::acquiring;
  const Region whole{0, 0, frame.image.width, frame.image.height};
  const bool partial = !frame.readable().contains(whole);

  PhotometricFit fit;
  if (holding && aligner.ready()) fit = align(frame, motion.predict(frame.capture_time));
  bool followed = holding;
  Refinement edges;
  if (!believed(fit)) {
    if (partial) {
      track.needs_whole_frame = true;
      return track;
    }
    edges = find_near(frame);
    if (edges.verdict != Verdict::lost) fit = finish(frame, edges);
    if (edges.verdict == Verdict::lost || !believed(fit)) {
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
      return track;
    }
  }
  holding = had_target = true;
  const bool good = believed(fit);
  const Eigen::Isometry3d& pose = fit.converged ? fit.camera_T_platform : edges.camera_T_platform;
  if (followed) {
    motion.add(frame.capture_time, pose);
  } else {
    motion.start(frame.capture_time, pose);
  }
  track.tags_held = fit.converged ? fit.tags_held : edges.tags_held;
  track.residual_px = edges.residual_px;
  track.status = Status::doubtful;
  say_misfit(good, track);
  if (!good) return track;
  track.status = Status::ok;
  track.displacement = motion_between(rest, pose);
  track.covariance = displacement_covariance(fit.covariance, track.displacement) +
                     geometry.covariance(track.displacement) + pose_covariance;
  if (aligner.ready()) track.wanted = region(frame.capture_time);
  if (!aligner.ready() && motion.step().head<3>().norm() < kStill &&
      motion.step().tail<3>().norm() < kStillAngle) {
    try {
      learn_picture(frame);
    } catch (const std::exception&) {
      return track;  // out of memory: edges alone will do
    }
  }
  return track;
}

Tracker::Tracker(const CameraModel& camera, const TargetDescription& target,
                 const RestOptions& rest)
    : state_(std::make_unique<State>(camera, target, rest)) {}

Tracker::~Tracker() = default;

Track Tracker::track(const Frame& frame) noexcept {
  if (!state_->readable(frame.image)) {
    state_->holding = false;
    Track absent;
    absent.status = state_->had_target ? Status::lost : Status::acquiring;
    return absent;
  }
  if (state_->rest_known) return state_->follow(frame);
  try {
    return state_->learn(frame);
  } catch (const std::exception&) {
    return {};  // out of memory: try again with the next frame
  }
}

}  // namespace tagwrench
