#include "host/calibration/target/recorder.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <numbers>
#include <utility>

#include "host/core/algebra/decompositions.h"
#include "host/core/config_error.h"
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

constexpr double kDegree = std::numbers::pi / 180.0;
constexpr double kMinView = 1.5 * kDegree;
constexpr double kMinFollowed = 0.5;  // of the frames in motion
constexpr double kMaxNoise_px = 0.3;  // of one edge
constexpr double kMaxFocalError = 0.01;
constexpr double kFocalSigmas = 3.0;
constexpr double kReadoutSigmas = 8;
constexpr double kMinReadoutGain = 0.05;   // of an edge's variance
constexpr double kMaxOffset = 10e-6;       // m, standard deviation of a plane along its normal
constexpr double kMaxTilt = 2e-3;          // rad, likewise
constexpr double kLearnedFraction = 0.98;  // and for the motion to have told anything

template <class... Args>
[[noreturn]] void refuse(fmt::format_string<Args...> line, Args&&... args) {
  throw ConfigError("calibrate target: " + fmt::format(line, std::forward<Args>(args)...));
}

void refuse_without_rest(const TargetRecorder::Counts& counts, std::size_t tags, int rest_frames) {
  if (counts.frames == 0) refuse("the source gave no frame; check --source");
  if (counts.flipped) {
    refuse(
        "the tags can be read only in the flipped image; change `mirrored` of sensor.yaml's camera "
        "and start again");
  }
  if (counts.most_tags_seen == 0) {
    refuse("no tag was seen in {} frames; check light, focus, and sensor.yaml's family and ids",
           counts.frames);
  }
  if (counts.most_tags_seen < static_cast<int>(tags)) {
    refuse(
        "{} of {} tags were seen in {} frames; all must be in view at rest, check what covers them "
        "and sensor.yaml's ids",
        counts.most_tags_seen, tags, counts.frames);
  }
  if (counts.moved > 0) {
    refuse("the platform never stood still for {} frames; keep your hands off at first",
           rest_frames);
  }
  refuse("{} frames do not make a rest of {} frames with all tags held; record more", counts.frames,
         rest_frames);
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
  if (progress != ReferenceEstimator::Progress::done) return;
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
  Eigen::AlignedBox2d seen;
  for (const Eigen::Vector3d& p : points_camera) {
    const ProjectedPoint projected = project(camera, p);
    if (projected.valid && projected.pixel.allFinite()) seen.extend(projected.pixel);
  }
  const Eigen::Array2d last(image.width - 1, image.height - 1);
  const Eigen::Array2d low = (seen.min().array() - kMargin_px).floor().max(0.0);
  const Eigen::Array2d high = (seen.max().array() + kMargin_px).ceil().min(last);
  Keyframe frame;
  frame.camera = camera;
  if (!(low <= high).all()) return frame;
  const int x0 = static_cast<int>(low.x()), y0 = static_cast<int>(low.y());
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

ViewSpan view_span(const std::vector<Keyframe>& frames,
                   const Eigen::Isometry3d& rest_camera_T_platform) {
  constexpr int kDirections = 36;
  Eigen::Matrix2Xd views(2, frames.size() + 1);
  for (std::size_t i = 0; i <= frames.size(); ++i) {
    const Vector6 displacement = i > 0 ? frames[i - 1].displacement : Vector6::Zero();
    const Eigen::Vector3d lens =
        moved(rest_camera_T_platform, displacement).inverse().translation();
    views.col(i) << std::atan2(lens.x(), -lens.z()), std::atan2(lens.y(), -lens.z());
  }
  ViewSpan span{0, 1e9};
  for (int i = 0; i < kDirections; ++i) {
    const double angle = std::numbers::pi * i / kDirections;
    const Eigen::Vector2d along(std::cos(angle), std::sin(angle));
    const Eigen::RowVectorXd seen = along.transpose() * views;
    const double width = seen.maxCoeff() - seen.minCoeff();
    span.widest = std::max(span.widest, width);
    span.narrowest = std::min(span.narrowest, width);
  }
  return span;
}

void check_record(const TargetRecorder& record, const TargetDescription& target,
                  const ReferenceOptions& rest) {
  const TargetRecorder::Counts& counts = record.counts();
  if (target.tags.size() < 2) {
    refuse(
        "one tag alone moves like the platform itself, so that motion tells nothing of its place; "
        "leave it to be learned at rest");
  }
  if (!record.rest_known()) refuse_without_rest(counts, target.tags.size(), rest.frames);
  if (counts.moving == 0) {
    refuse(
        "all frames were needed for the rest; record more, and move the platform about after it");
  }
  if (counts.followed < kMinFollowed * counts.moving) {
    refuse(
        "all tags were held in only {} of {} frames; keep them in view, lit and in focus, and move "
        "more slowly",
        counts.followed, counts.moving);
  }
  const ViewSpan span =
      view_span(record.keyframes(), midpoint_frame(record.at_rest().camera_T_tag));
  if (span.narrowest < kMinView) {
    const bool still = span.widest < kMinView;
    refuse(
        "the platform {}: the view of the tags turned by {:.1f} degrees one way and {:.1f} the "
        "other, {:.1f} are needed both ways; tilt it, or push it sideways, along x and along y",
        still ? "hardly moved" : "moved in one plane only", span.widest / kDegree,
        span.narrowest / kDegree, kMinView / kDegree);
  }
  if (record.keyframes().size() < kMinKeyframes) {
    refuse("{} different pictures are too few, {} are needed; move for longer",
           record.keyframes().size(), kMinKeyframes);
  }
}

void check_estimate(const TargetEstimate& estimate, const TargetDescription& target,
                    const CameraModel& camera) {
  if (!estimate.solved) {
    refuse(
        "the recording does not determine the tags' places; record again with slow, large motions "
        "along every axis");
  }
  const double off = std::abs(estimate.focal_ratio - 1);  // with an infinite sigma where not told
  if (off > kMaxFocalError && off > kFocalSigmas * estimate.focal_sigma) {
    refuse(
        "the focal length that fits best is {:.1f} +- {:.1f} px, sensor.yaml says {:.1f}; run "
        "`tagwrench calibrate camera`, or check tag_size_mm",
        camera.fx_px * estimate.focal_ratio, camera.fx_px * estimate.focal_sigma, camera.fx_px);
  }
  if (!(estimate.noise_px < kMaxNoise_px)) {
    refuse(
        "edges lie {:.2f} px off where a rigid target would show them, {:.1f} is the limit; check "
        "that the tags sit firmly on the platform, then run `tagwrench calibrate camera`",
        estimate.noise_px, kMaxNoise_px);
  }
  if (better_known(estimate, kLearnedFraction) == 0) {
    refuse(
        "the motion tells nothing that the rest image does not; tilt and push further, with better "
        "light");
  }
  const TargetSigmas sigmas = target_sigmas(estimate, target);
  if (sigmas.tilt() > kMaxTilt || sigmas.offset() > kMaxOffset) {
    refuse(
        "the tags' planes stay uncertain by {:.1f} um and {:.2f} mrad, {:.0f} and {:.0f} are the "
        "limit; move further and longer, and check focus, light and print",
        sigmas.offset() * 1e6, sigmas.tilt() * 1e3, kMaxOffset * 1e6, kMaxTilt * 1e3);
  }
}

double TargetSigmas::tilt() const {
  double largest = 0;
  for (const Vector6& sigma : tag) largest = std::max({largest, sigma[3], sigma[4]});
  return largest;
}

double TargetSigmas::offset() const {
  double largest = 0;
  for (const Vector6& sigma : tag) largest = std::max(largest, sigma[2]);
  return largest;
}

TargetSigmas target_sigmas(const Eigen::MatrixXd& covariance,
                           const std::vector<Eigen::Isometry3d>& camera_T_tag) {
  const Eigen::Index all = covariance.rows();
  const auto tags = static_cast<double>(camera_T_tag.size());
  Eigen::VectorXd distances = Eigen::VectorXd::Zero(all);  // motion of the tags by the scale
  Eigen::VectorXd scale = Eigen::VectorXd::Zero(all);      // scale by the tags' motion
  for (std::size_t t = 0; t < camera_T_tag.size(); ++t) {
    const Eigen::Vector3d& place = camera_T_tag[t].translation();
    distances.segment<3>(6 * static_cast<Eigen::Index>(t)) = place;
    scale.segment<3>(6 * static_cast<Eigen::Index>(t)) = place / (place.squaredNorm() * tags);
  }
  const Eigen::MatrixXd without =
      Eigen::MatrixXd::Identity(all, all) - distances * scale.transpose();
  const Eigen::MatrixXd shape = without * covariance * without.transpose();
  TargetSigmas out;
  out.scale = std::sqrt(std::max(0.0, scale.dot(covariance * scale)));
  for (std::size_t t = 0; t < camera_T_tag.size(); ++t) {
    const auto at = 6 * static_cast<Eigen::Index>(t);
    out.tag.push_back(tag_sigma(shape.block<6, 6>(at, at), camera_T_tag[t].linear()));
  }
  return out;
}

double widest_spread(const TargetEstimate& estimate) {
  double widest = 0;
  for (const PrintModes& print : estimate.print) widest = std::max(widest, std::abs(print[0]));
  return widest;
}

TargetSigmas target_sigmas(const TargetEstimate& estimate, const TargetDescription& target) {
  TargetSigmas out = target_sigmas(estimate.covariance, estimate.camera_T_tag);
  out.scale = std::hypot(out.scale, print_size_sigma(estimate.print_scatter,
                                                     widest_spread(estimate), target.tag_size));
  return out;
}

TargetDescription calibrated_target(const TargetDescription& target,
                                    const TargetEstimate& estimate) {
  TargetDescription out = target;
  const Eigen::Isometry3d platform = midpoint_frame(estimate.camera_T_tag);
  const TargetSigmas sigmas = target_sigmas(estimate, target);
  out.scale_sigma = sigmas.scale;
  for (std::size_t t = 0; t < out.tags.size(); ++t) {
    out.tags[t].platform_T_tag = platform.inverse() * estimate.camera_T_tag[t];
    out.tags[t].sigma = sigmas.tag[t];
    for (const int axis : {0, 1})
      out.tags[t].sigma[axis] = std::hypot(sigmas.tag[t][axis], kPrintCentre);
  }
  return out;
}

int better_known(const TargetEstimate& estimate, double part) {
  const Eigen::VectorXd shares =
      generalized_eigenvalues(estimate.covariance, estimate.covariance_at_rest);
  return static_cast<int>((shares.array() < part * part).count());
}

bool readout_is_clear(const TargetEstimate& estimate) {
  return estimate.readout > kReadoutSigmas * estimate.readout_sigma &&
         estimate.readout_gain > kMinReadoutGain;
}

std::vector<std::string> describe(const TargetRecorder& record, const TargetEstimate& estimate,
                                  const TargetDescription& target, const CameraModel& camera) {
  const TargetRecorder::Counts& counts = record.counts();
  const Vector6 range = record.range();
  const ViewSpan span =
      view_span(record.keyframes(), midpoint_frame(record.at_rest().camera_T_tag));
  std::vector<std::string> lines;
  lines.push_back(fmt::format(
      "{} frames at rest; then {} of {} with all tags held; {} different pictures, {} edge points",
      record.at_rest().image.frames, counts.followed, counts.moving, record.keyframes().size(),
      estimate.points));
  lines.push_back(fmt::format(
      "excited: x {:.2f}, y {:.2f}, z {:.2f} mm; about x {:.1f}, y {:.1f}, z {:.1f} degrees; the "
      "view turned by {:.1f} and {:.1f} degrees ({:.1f} needed both ways)",
      range[0] * 1e3, range[1] * 1e3, range[2] * 1e3, range[3] / kDegree, range[4] / kDegree,
      range[5] / kDegree, span.widest / kDegree, span.narrowest / kDegree, kMinView / kDegree));
  const Eigen::Isometry3d platform = midpoint_frame(estimate.camera_T_tag);
  const TargetSigmas after = target_sigmas(estimate, target);
  const TargetSigmas before = target_sigmas(estimate.covariance_at_rest, estimate.camera_T_tag);
  for (std::size_t t = 0; t < target.tags.size(); ++t) {
    const Vector6 pose = motion_between(Eigen::Isometry3d::Identity(),
                                        platform.inverse() * estimate.camera_T_tag[t]);
    const auto plane = [&](const TargetSigmas& sigmas) {
      const Vector6& s = sigmas.tag[t];
      return fmt::format("{:.1f} um along its normal, {:.2f} and {:.2f} mrad of tilt", s[2] * 1e6,
                         s[3] * 1e3, s[4] * 1e3);
    };
    lines.push_back(fmt::format(
        "tag {}: position {:.4f} {:.4f} {:.4f} mm, rotation {:.5f} {:.5f} {:.5f} rad; its plane to "
        "+- {} (from the rest alone +- {})",
        target.tags[t].id, pose[0] * 1e3, pose[1] * 1e3, pose[2] * 1e3, pose[3], pose[4], pose[5],
        plane(after), plane(before)));
  }
  lines.push_back(fmt::format(
      "scale: +- {:.1f} %, from the tags' size as printed (edges scatter by {:.1f} um about the "
      "pattern, ink or light spreads by up to {:.1f} um); a calibration in newtons absorbs it",
      100 * after.scale, estimate.print_scatter * 1e6, 1e6 * widest_spread(estimate)));
  lines.push_back(
      std::isfinite(estimate.focal_sigma)
          ? fmt::format("focal length: {:.2f} +- {:.2f} px fits best, sensor.yaml says {:.2f}",
                        camera.fx_px * estimate.focal_ratio, camera.fx_px * estimate.focal_sigma,
                        camera.fx_px)
          : fmt::format("focal length: this motion does not tell it; sensor.yaml says {:.2f} px",
                        camera.fx_px));
  lines.back() += fmt::format("; residual {:.3f} px", estimate.residual_px);
  lines.push_back(fmt::format(
      "read-out: {:.1f} +- {:.1f} ms from the first row to the last, sensor.yaml says {:.1f}{}",
      std::round(estimate.readout * 1e4) * 0.1 + 0.0,  // never "-0"
      estimate.readout_sigma * 1e3, camera.readout * 1e3,
      readout_is_clear(estimate) ? "" : "; not clearly other than 0"));
  return lines;
}

}  // namespace tagwrench
