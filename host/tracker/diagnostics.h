// What a person should know of how the target is tracked: why it is not held, and what spoils
// measurements while it is.
#pragma once

#include <optional>

#include "host/tracker/acquire.h"
#include "host/tracker/photometric.h"
#include "host/tracker/print_check.h"
#include "host/tracker/reference.h"
#include "host/tracker/rotation.h"

namespace tagwrench {

/// Are pictures not accepted because a rolling shutter shears them while the target moves, and the
/// sensor does not say so? Tries such pictures of a moving target once more, as if their rows had
/// been exposed one after the other. What else spoils pictures (things before the lens, glare, blur
/// of motion) is not mended by that; nor is a sheared one by rows in the other order.
class ShutterCheck {
 public:
  /// Where the target is in the frame of this time, accepted or not.
  void seen(TimePoint time, const Eigen::Isometry3d& camera_T_platform) noexcept {
    predictor_.add(time, camera_T_platform);
  }
  void lost() noexcept { predictor_.start({}, Eigen::Isometry3d::Identity()); }

  /// Before seen(): the picture of a fit that was not accepted, its pose, and the state before it.
  /// True once, when enough pictures have been mended and few have not.
  bool rolls(PhotometricAligner& aligner, const PixelWindow& image, TimePoint time,
             const Eigen::Isometry3d& pose, const PhotometricState& before) noexcept;

 private:
  ConstantVelocityPredictor predictor_;  ///< through frames that are not accepted too
  int mended_ = 0;
  int tried_ = 0;
  bool done_ = false;
};

struct Diagnosis {
  Diagnostic cause = Diagnostic::none;
  DiagnosticDetails details;
};

/// Looks at one picture: the cause that explains most, or none when nothing is certain. Allocates;
/// costs about as much as finding tags.
Diagnosis diagnose(const CameraModel& camera, const TargetDescription& target,
                   const KnownReference& reference, const ImageView& image, const Finding& finding);

/// What the tracker made of one frame.
struct FrameFacts {
  const Frame& frame;
  const KnownReference& reference;
  const Finding& finding;  ///< of the last search
  PhotometricAligner& aligner;
  const PhotometricState& photometric;
  bool searched = false;  ///< the last search was in this frame
  /// While the reference is learned: what became of this frame.
  std::optional<ReferenceEstimator::Progress> learning{};
  std::optional<Eigen::Isometry3d> pose{};  ///< while the target is held
  bool accepted = false;                    ///< and numbers were made of it
  bool by_picture = false;                  ///< and not by edges, which lie a little elsewhere
  std::optional<OtherPrint> other_print{};  ///< then no numbers are made
};

/// Says each cause why the target is not held once: when two looks in a row agree, and then not
/// again until another one has been said or the target was held. No heap while the target is held
/// and its fits are accepted.
class TrackingDiagnostics {
 public:
  TrackingDiagnostics(const CameraModel& camera, const TargetDescription& target)
      : camera_(camera), target_(target) {}

  /// Every frame that could be judged. Fills `diagnostic` and `details` of the track.
  void add(const FrameFacts& facts, Track& track);

 private:
  void explain(const FrameFacts& facts, Track& track);
  void check_geometry(const FrameFacts& facts, Track& track);
  void check_print(const FrameFacts& facts, Track& track);
  void check_shutter(const FrameFacts& facts, Track& track);
  void check_picture(const FrameFacts& facts, Track& track);
  void check_distance(const FrameFacts& facts, Track& track);

  CameraModel camera_;
  TargetDescription target_;
  // Of a target that is not held.
  std::optional<TimePoint> not_held_since_;
  TimePoint next_look_{};
  TimePoint quiet_until_{};
  Diagnosis last_look_;
  Diagnosis said_;
  // Of one that is.
  bool geometry_checked_ = false;
  int other_prints_ = 0;           ///< frames in a row
  int misfits_ = 0;                ///< to a given picture, frames in a row
  bool distance_checked_ = false;  ///< said to be far from its reference, or seen to be there
  std::optional<TimePoint> still_since_;  ///< only while that is open
  Vector6 still_at_ = Vector6::Zero();    ///< m, rad, from the reference
  bool still_by_picture_ = false;
  ShutterCheck shutter_;
};

}  // namespace tagwrench
