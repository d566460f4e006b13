#include "host/calibration/target/recorder.h"

#include <algorithm>
#include <chrono>
#include <optional>

#include "host/tracker/acquire.h"
#include "host/tracker/reference.h"
#include "host/tracker/rotation.h"
#include "host/tracker/tracker.h"

namespace tagwrench {
namespace {

/// From the frame before a picture to the one after it: longer says too little of the velocity, s.
constexpr double kMaxStep = 0.15;

TargetDescription without_placement(TargetDescription target) {
  for (Tag& tag : target.tags) {
    tag.platform_T_tag.reset();
    tag.sigma.setZero();
  }
  return target;
}

ReferenceOptions only_frames(const ReferenceOptions& rest) {
  ReferenceOptions out;
  out.frames = rest.frames;
  return out;
}

}  // namespace

struct TargetRecorder::State {
  State(const CameraModel& model, const TargetDescription& description,
        const ReferenceOptions& rest, std::size_t most_keyframes)
      : camera(model),
        target(without_placement(description)),
        acquirer(model, target),
        learner(model, target, only_frames(rest), acquirer.patterns()),
        tracker(model, target, only_frames(rest)),
        keyframes(most_keyframes) {}

  void learn(const ImageView& image);
  void finish();
  void follow(const Frame& frame, const Track& track);

  CameraModel camera;
  TargetDescription target;
  Acquirer acquirer;
  ReferenceEstimator learner;
  Tracker tracker;
  KeyframeSet keyframes;
  bool rest_known = false;
  Eigen::Isometry3d rest_pose = Eigen::Isometry3d::Identity();
  TargetAtRest at_rest;
  std::vector<Eigen::Vector3d> outline;  // the tags' papers, platform coordinates
  Counts counts;
  struct Followed {
    TimePoint time{};
    Eigen::Isometry3d pose;
  };
  std::optional<Followed> latest;   // the last frames that were followed, in a row
  std::optional<Followed> earlier;  // before `latest`
  std::optional<Keyframe> waiting;  // the latest frame's, until its velocity is known
  Vector6 lowest = Vector6::Zero();
  Vector6 highest = Vector6::Zero();
};

void TargetRecorder::State::learn(const ImageView& image) {
  const Finding finding = learner.wants_finding() ? acquirer.find(image) : Finding{};
  const ReferenceEstimator::Progress progress = learner.add(image, finding);
  counts.most_tags_seen = std::max(counts.most_tags_seen, learner.tags_seen());
  if (progress == ReferenceEstimator::Progress::moved) ++counts.moved;
  if (progress == ReferenceEstimator::Progress::done) finish();
}

void TargetRecorder::State::finish() {
  at_rest.camera = camera;
  at_rest.image = learner.learned().image;
  at_rest.patterns = acquirer.patterns();
  rest_pose = learner.learned().camera_T_platform;
  const double half = 0.5 * target.tag_size + target.border;
  for (const EdgeTag& tag : learner.learned().target.tags) {
    at_rest.camera_T_tag.push_back(rest_pose * tag.platform_T_tag);
    for (const double x : {-half, half}) {
      for (const double y : {-half, half})
        outline.push_back(tag.platform_T_tag * Eigen::Vector3d(x, y, 0));
    }
  }
  rest_known = true;
}

/// A picture's velocity is the mean of the steps before it and after it: it counts only where the
/// frames on both sides were followed.
void TargetRecorder::State::follow(const Frame& frame, const Track& track) {
  ++counts.moving;
  if (track.status != Status::ok || track.tags_held < target.tags.size()) {
    latest.reset();
    earlier.reset();
    waiting.reset();
    return;
  }
  ++counts.followed;
  lowest = lowest.cwiseMin(track.displacement);
  highest = highest.cwiseMax(track.displacement);
  const Eigen::Isometry3d pose = moved(rest_pose, track.displacement);
  if (waiting && earlier) {
    const double seconds =
        std::chrono::duration<double>(frame.capture_time - earlier->time).count();
    waiting->velocity = motion_between(earlier->pose, pose) / seconds;
    if (seconds > 0 && seconds < kMaxStep) keyframes.add(std::move(*waiting));
  }
  waiting.reset();
  earlier = latest;
  latest = {frame.capture_time, pose};
  if (!earlier || !keyframes.wants(track.displacement)) return;
  std::vector<Eigen::Vector3d> seen;
  for (const Eigen::Vector3d& p : outline) seen.push_back(pose * p);
  Keyframe keyframe = cropped(frame.image, camera, seen);
  keyframe.displacement = track.displacement;
  if (!keyframe.pixels.empty()) waiting = std::move(keyframe);
}

TargetRecorder::TargetRecorder(const CameraModel& camera, const TargetDescription& target,
                               const ReferenceOptions& rest, std::size_t most_keyframes)
    : state_(std::make_unique<State>(camera, target, rest, most_keyframes)) {}

TargetRecorder::~TargetRecorder() = default;

Track TargetRecorder::add(const Frame& frame) {
  ++state_->counts.frames;
  const Track track = state_->tracker.track(frame);
  if (track.diagnostic == Diagnostic::image_looks_mirrored ||
      track.diagnostic == Diagnostic::image_looks_unmirrored)
    state_->counts.flipped = true;
  const ImageView& image = frame.image;
  const CameraModel& camera = state_->camera;
  if (image.pixels == nullptr || image.width != camera.width_px || image.height != camera.height_px)
    return track;
  if (state_->rest_known) {
    state_->follow(frame, track);
  } else {
    state_->learn(image);
  }
  return track;
}

bool TargetRecorder::rest_known() const noexcept { return state_->rest_known; }
const TargetAtRest& TargetRecorder::at_rest() const noexcept { return state_->at_rest; }
const std::vector<Keyframe>& TargetRecorder::keyframes() const noexcept {
  return state_->keyframes.frames();
}
const TargetRecorder::Counts& TargetRecorder::counts() const noexcept { return state_->counts; }
Vector6 TargetRecorder::range() const { return state_->highest - state_->lowest; }

}  // namespace tagwrench
