// Room calibration/target: the platform at rest and moved about -> where its tags sit.
// In:  frames of a source; the camera as calibrated.
// Out: each tag's pose in the platform frame (m, rad) with sigmas, the rest pose in the
//      camera frame, the picture at rest, the shutter's read-out (s).
// Then: adjust.h (the least squares), equations.h.
//
// First the platform is seen at rest, then in motion; then whether that, and what was found, is
// good enough to be written.
#pragma once

#include <optional>
#include <string>
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

/// How much the direction changed from which the lens sees the platform: the parallax that tells
/// where the tags' planes lie. Tilting and pushing sideways both change it. rad, over all keyframes
/// and the rest, along the directions of the largest and of the smallest change.
struct ViewSpan {
  double widest = 0, narrowest = 0;
};

ViewSpan view_span(const std::vector<Keyframe>& frames,
                   const Eigen::Isometry3d& rest_camera_T_platform);

/// So many different pictures at least a recording must have.
inline constexpr std::size_t kMinKeyframes = 20;

/// Throws ConfigError, one line with what is missing and what to do, for a recording that cannot
/// show where the tags sit: one tag only, no rest, tags lost, too few different pictures, seen from
/// one side.
void check_record(const TargetRecorder& record, const TargetDescription& target,
                  const ReferenceOptions& rest);

/// Throws ConfigError for an adjustment that must not be believed: no solution, edges off the
/// model, another focal length, nothing learned from the motion, too uncertain.
void check_estimate(const TargetEstimate& estimate, const TargetDescription& target,
                    const CameraModel& camera);

/// How well the tags' places are known.
struct TargetSigmas {
  /// Of each tag, along its own axes: m, rad; the scale of all taken out. Along x and y and about z
  /// every edge point has a place of its own, so that motion cannot tell these and tracking does
  /// not feel them; the plane is what counts: tilt about x and y, and place along z.
  std::vector<Vector6> tag;
  double scale = 0;  ///< of all distances together, a part

  double tilt() const;    ///< the largest, rad
  double offset() const;  ///< along a normal, the largest, m
};

/// `covariance` of all tags' motions (6 each, camera axes); the scale's is that of the tags' mean
/// distance from the lens.
TargetSigmas target_sigmas(const Eigen::MatrixXd& covariance,
                           const std::vector<Eigen::Isometry3d>& camera_T_tag);

/// After the motion, with what the size of the print leaves open.
TargetSigmas target_sigmas(const TargetEstimate& estimate, const TargetDescription& target);

/// The target with its tags where the motion has them, and how well that is known.
TargetDescription calibrated_target(const TargetDescription& target,
                                    const TargetEstimate& estimate);

/// Of the unknowns of all tags, combinations whose standard deviation the motion has brought below
/// this part of that from the rest image alone.
int better_known(const TargetEstimate& estimate, double part);

/// Whether the recording tells that the shutter rolls, and how fast: many sigmas, and a fit that is
/// clearly better with it. A global shutter's never does.
bool readout_is_clear(const TargetEstimate& estimate);

/// Lines for people: what was excited, where the tags are and how well that is known.
std::vector<std::string> describe(const TargetRecorder& record, const TargetEstimate& estimate,
                                  const TargetDescription& target, const CameraModel& camera);

}  // namespace tagwrench
