#include "host/tracker/tracker.h"

#include <algorithm>
#include <exception>
#include <optional>

#include "host/config_error.h"
#include "host/tracker/acquire.h"
#include "host/tracker/corner_pose.h"
#include "host/tracker/motion.h"
#include "host/tracker/refine.h"
#include "host/tracker/rest.h"

namespace tagwrench {
namespace {

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
  State(const CameraModel& model, const TargetDescription& description, const RestOptions& options)
      : camera(model),
        tag_size(description.tag_size),
        acquirer(model, description),
        refiner(model),
        learner(model, description, options, acquirer.patterns()) {
    const bool placed = std::all_of(description.tags.begin(), description.tags.end(),
                                    [](const Tag& tag) { return tag.platform_T_tag.has_value(); });
    if (placed && options.camera_T_platform) {
      LearnedRest given{*options.camera_T_platform, {}};
      for (std::size_t t = 0; t < description.tags.size(); ++t) {
        given.target.tags.push_back(
            make_edge_tag(acquirer.patterns()[t], *description.tags[t].platform_T_tag));
      }
      adopt(given);
    }
  }

  void adopt(const LearnedRest& learned) {
    rest = learned.camera_T_platform;
    refiner.set_target(learned.target);
    platform_T_tag.clear();
    for (const EdgeTag& tag : learned.target.tags) platform_T_tag.push_back(tag.platform_T_tag);
    motion.start({}, rest);
    rest_known = true;
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
  Refinement reacquire(const Frame& frame, Track& track);
  Refinement refine_within_reach(const Frame& frame, const Eigen::Isometry3d& start) noexcept;

  CameraModel camera;
  double tag_size;
  Acquirer acquirer;
  Refiner refiner;
  RestLearner learner;
  bool rest_known = false;
  Eigen::Isometry3d rest = Eigen::Isometry3d::Identity();
  std::vector<Eigen::Isometry3d> platform_T_tag;
  bool had_target = false;
  bool holding = false;
  Motion motion;
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

Track Tracker::State::follow(const Frame& frame) noexcept {
  Track track;
  track.status = had_target ? Status::lost : Status::acquiring;
  Refinement fit;
  const bool followed = holding;
  if (holding) {
    fit = refine_within_reach(frame, motion.predict(frame.capture_time));
    // A motion that stops dead is nearer to where it was than to where it was going.
    if (fit.verdict == Verdict::lost) fit = refine_within_reach(frame, motion.last());
  }
  bool found_again = false;
  if (fit.verdict == Verdict::lost) {
    try {
      fit = reacquire(frame, track);
      found_again = true;
    } catch (const std::exception&) {
      fit = {};  // out of memory: try again with the next frame
    }
  }
  holding = fit.verdict != Verdict::lost;
  if (!holding) return track;
  had_target = true;
  if (followed && !found_again) {
    motion.add(frame.capture_time, fit.camera_T_platform);
  } else {
    motion.start(frame.capture_time, fit.camera_T_platform);
  }
  track.residual_px = fit.residual_px;
  track.tags_held = fit.tags_held;
  track.status = Status::doubtful;
  if (fit.verdict != Verdict::held) return track;
  track.status = Status::ok;
  track.displacement = motion_between(rest, fit.camera_T_platform);
  track.covariance = displacement_covariance(fit.covariance, track.displacement);
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
