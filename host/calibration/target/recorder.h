// Room calibration/target: the platform at rest and moved about -> where its tags sit.
// In:  frames of a source; the camera as calibrated.
// Out: each tag's pose in the platform frame (m, rad) with sigmas, the rest pose in the
//      camera frame, the picture at rest, the shutter's read-out (s).
// Then: adjust.h (the least squares), verdict.h (what a recording cannot tell).
//
// From a source's frames to what a calibration of the target works on: first the platform at rest,
// then in motion.
#pragma once

#include <optional>
#include <vector>

#include "host/calibration/target/adjust.h"
#include "host/core/types.h"
#include "host/tracker/reference.h"
#include "host/tracker/tracker.h"

namespace tagwrench {

/// The part of `image` (as the camera delivers it) that shows the points, with a margin for the
/// profiles across edges. Empty pixels where it shows none of them.
Keyframe cropped(const ImageView& image, const CameraModel& camera,
                 const std::vector<Eigen::Vector3d>& points_camera);

/// Keeps at most `capacity` pictures that differ in displacement by as much as there is room for.
class KeyframeSet {
 public:
  explicit KeyframeSet(std::size_t capacity) : capacity_(capacity) {}

  /// Worth cropping: far enough from all that are kept.
  bool wants(const Vector6& displacement) const;
  void add(Keyframe frame);

  const std::vector<Keyframe>& frames() const noexcept { return frames_; }

 private:
  static constexpr double kFirstSpacing = 5e-6;  // m, see distance()

  std::size_t capacity_;
  double spacing_ = kFirstSpacing;
  std::vector<Keyframe> frames_;
};

class TargetRecorder {
 public:
  /// Placement and rest pose that `target` and `rest` may give are set aside: they are what is to
  /// be found. Throws ConfigError for a target that cannot be tracked.
  TargetRecorder(const CameraModel& camera, const TargetDescription& target,
                 const ReferenceOptions& rest, std::size_t max_keyframes);

  /// What the tracker says about it. Never throws for what a frame shows.
  Track add(const Frame& frame);

  bool rest_known() const noexcept { return rest_known_; }
  /// Once rest_known().
  const TargetAtRest& at_rest() const noexcept { return at_rest_; }
  const std::vector<Keyframe>& keyframes() const noexcept { return keyframes_.frames(); }

  struct Counts {
    int frames = 0;          ///< all
    int most_tags_seen = 0;  ///< in one frame, before the rest is known
    int moved = 0;           ///< restarts of the rest because the platform moved
    int moving = 0;          ///< frames since the rest is known
    int followed = 0;        ///< of these, with all tags held
    bool flipped = false;    ///< tags decode only in the image flipped the other way
  };
  const Counts& counts() const noexcept { return counts_; }

  /// From the smallest to the largest displacement that was followed, m and rad.
  Vector6 range() const { return highest_ - lowest_; }

 private:
  struct Followed {
    TimePoint time{};
    Eigen::Isometry3d pose;
  };
  void learn(const ImageView& image);
  void finish();
  void follow(const Frame& frame, const Track& track);

  CameraModel camera_;
  TargetDescription target_;
  Acquirer acquirer_;
  ReferenceEstimator learner_;
  Tracker tracker_;
  KeyframeSet keyframes_;
  bool rest_known_ = false;
  Eigen::Isometry3d rest_pose_ = Eigen::Isometry3d::Identity();
  TargetAtRest at_rest_;
  std::vector<Eigen::Vector3d> outline_;  ///< the tags' papers, platform coordinates
  Counts counts_;
  std::optional<Followed> latest_;   ///< the last frames that were followed, in a row
  std::optional<Followed> earlier_;  ///< before `latest_`
  std::optional<Keyframe> waiting_;  ///< the latest frame's, until its velocity is known
  Vector6 lowest_ = Vector6::Zero();
  Vector6 highest_ = Vector6::Zero();
};

}  // namespace tagwrench
