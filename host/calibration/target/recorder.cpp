#include "host/calibration/target/recorder.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <utility>

#include "host/tracker/acquire.h"
#include "host/tracker/camera_model.h"
#include "host/tracker/rotation.h"

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

constexpr double kMargin_px = 16.0;      // profiles reach 6 px, and the pose may be a pixel off
constexpr double kSpacingGrowth = 1.25;  // each time the set is full

/// How different two displacements are, m: a rotation counts by what it moves at the distance of
/// the lens.
double distance(const Vector6& a, const Vector6& b) {
  constexpr double kLever = 20e-3;  // m
  const Vector6 d = a - b;
  return std::sqrt(d.head<3>().squaredNorm() + kLever * kLever * d.tail<3>().squaredNorm());
}

}  // namespace

TargetRecorder::TargetRecorder(const CameraModel& camera, const TargetDescription& target,
                               const ReferenceOptions& rest, std::size_t max_keyframes)
    : camera_(camera),
      target_(without_placement(target)),
      acquirer_(camera, target_),
      learner_(camera, target_, {.frames = rest.frames}, acquirer_.patterns()),
      tracker_(camera, target_, {.frames = rest.frames}),
      keyframes_(max_keyframes) {}

void TargetRecorder::learn(const ImageView& image) {
  const Finding finding = learner_.wants_finding() ? acquirer_.find(image) : Finding{};
  const ReferenceEstimator::Progress progress = learner_.add(image, finding);
  counts_.most_tags_seen = std::max(counts_.most_tags_seen, learner_.tags_seen());
  if (progress == ReferenceEstimator::Progress::moved) ++counts_.moved;
  if (progress == ReferenceEstimator::Progress::done) finish();
}

void TargetRecorder::finish() {
  at_rest_.camera = camera_;
  at_rest_.image = learner_.learned().image;
  at_rest_.patterns = acquirer_.patterns();
  rest_pose_ = learner_.learned().camera_T_platform;
  const double half = 0.5 * target_.tag_size + target_.border;
  for (const EdgeTag& tag : learner_.learned().target.tags) {
    at_rest_.camera_T_tag.push_back(rest_pose_ * tag.platform_T_tag);
    for (const Eigen::Vector3d& corner : square_corners(half))
      outline_.push_back(tag.platform_T_tag * corner);
  }
  rest_known_ = true;
}

/// A picture's velocity is the mean of the steps before it and after it: it counts only where the
/// frames on both sides were followed.
void TargetRecorder::follow(const Frame& frame, const Track& track) {
  ++counts_.moving;
  if (track.status != Status::ok || track.tags_held < target_.tags.size()) {
    latest_.reset();
    earlier_.reset();
    waiting_.reset();
    return;
  }
  ++counts_.followed;
  lowest_ = lowest_.cwiseMin(track.displacement);
  highest_ = highest_.cwiseMax(track.displacement);
  const Eigen::Isometry3d pose = moved(rest_pose_, track.displacement);
  if (waiting_ && earlier_) {
    const double seconds =
        std::chrono::duration<double>(frame.capture_time - earlier_->time).count();
    waiting_->velocity = motion_between(earlier_->pose, pose) / seconds;
    if (seconds > 0 && seconds < kMaxStep) keyframes_.add(std::move(*waiting_));
  }
  waiting_.reset();
  earlier_ = latest_;
  latest_ = {frame.capture_time, pose};
  if (!earlier_ || !keyframes_.wants(track.displacement)) return;
  std::vector<Eigen::Vector3d> seen;
  for (const Eigen::Vector3d& p : outline_) seen.push_back(pose * p);
  Keyframe keyframe = cropped(frame.image, camera_, seen);
  keyframe.displacement = track.displacement;
  if (!keyframe.pixels.empty()) waiting_ = std::move(keyframe);
}

Track TargetRecorder::add(const Frame& frame) {
  ++counts_.frames;
  const Track track = tracker_.track(frame);
  if (track.diagnostic == Diagnostic::image_looks_mirrored ||
      track.diagnostic == Diagnostic::image_looks_unmirrored)
    counts_.flipped = true;
  const ImageView& image = frame.image;
  if (image.pixels == nullptr || image.width != camera_.width_px ||
      image.height != camera_.height_px)
    return track;
  if (rest_known_)
    follow(frame, track);
  else
    learn(image);
  return track;
}

Keyframe cropped(const ImageView& image, const CameraModel& camera,
                 const std::vector<Eigen::Vector3d>& points_camera) {
  Eigen::Array2d low(1e9, 1e9);
  Eigen::Array2d high(-1e9, -1e9);
  for (const Eigen::Vector3d& p : points_camera) {
    const ProjectedPoint projected = project(camera, p);
    if (!projected.valid || !projected.pixel.allFinite()) continue;
    low = low.min(projected.pixel.array());
    high = high.max(projected.pixel.array());
  }
  const Eigen::Array2d last(image.width - 1, image.height - 1);
  low = (low - kMargin_px).floor().max(0.0);
  high = (high + kMargin_px).ceil().min(last);
  Keyframe frame;
  frame.camera = camera;
  if (!(low <= high).all()) return frame;
  const int x0 = static_cast<int>(low.x());
  const int y0 = static_cast<int>(low.y());
  const int width = static_cast<int>(high.x()) - x0 + 1;
  const int height = static_cast<int>(high.y()) - y0 + 1;
  frame.camera.width_px = width;
  frame.camera.height_px = height;
  frame.camera.cx_px -= x0;
  frame.camera.cy_px -= y0;
  frame.camera.mirrored = false;
  frame.first_row = y0;
  frame.image_rows = image.height;
  frame.pixels.resize(static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
  auto to = frame.pixels.begin();
  for (int row = y0; row < y0 + height; ++row) {
    const std::uint8_t* from = image.pixels + static_cast<std::ptrdiff_t>(row) * image.stride;
    if (camera.mirrored)
      to = std::reverse_copy(from + image.width - x0 - width, from + image.width - x0, to);
    else
      to = std::copy(from + x0, from + x0 + width, to);
  }
  return frame;
}

bool KeyframeSet::wants(const Vector6& displacement) const {
  return std::none_of(frames_.begin(), frames_.end(), [&](const Keyframe& kept) {
    return distance(kept.displacement, displacement) < spacing_;
  });
}

void KeyframeSet::add(Keyframe frame) {
  frames_.push_back(std::move(frame));
  while (frames_.size() > capacity_) {
    spacing_ *= kSpacingGrowth;
    std::vector<Keyframe> all;
    all.swap(frames_);
    for (Keyframe& kept : all)
      if (wants(kept.displacement)) frames_.push_back(std::move(kept));
  }
}

}  // namespace tagwrench
