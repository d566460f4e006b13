// Why the target is not held, from what the camera shows: asked only then, now and then.
#pragma once

#include <optional>
#include <vector>

#include "host/tracker/acquire.h"

namespace tagwrench {

/// What is known of the target at rest so far.
struct KnownReference {
  bool known = false;
  bool given = false;  ///< by the sensor's description, not learned
  Eigen::Isometry3d camera_T_platform = Eigen::Isometry3d::Identity();
  std::vector<Eigen::Isometry3d> platform_T_tag;  ///< in the target's order
};

struct Diagnosis {
  Diagnostic cause = Diagnostic::none;
  DiagnosticDetails details;
};

/// Looks at one picture: the cause that explains most, or none when nothing is certain. Allocates;
/// costs about as much as finding tags. Throws what the library throws that finds them.
Diagnosis diagnose(const CameraModel& camera, const TargetDescription& target,
                   const KnownReference& rest, const ImageView& image, const Finding& finding);

/// Asks diagnose() at times, and says each cause once: when two looks in a row agree, and then not
/// again until another one has been said or the target was held.
class TrackingDiagnostics {
 public:
  TrackingDiagnostics(const CameraModel& camera, const TargetDescription& target)
      : camera_(camera), target_(target) {}

  /// All is well in the frame of this time.
  void held() noexcept {
    if (!not_held_since_) return;
    not_held_since_.reset();
    said_ = {};
  }

  /// The target is not held in the frame of this time, whose whole image was searched with this
  /// result. A cause when there is something to be said. Never throws.
  Diagnosis not_held(TimePoint time, const KnownReference& rest, const ImageView& image,
                     const Finding& finding) noexcept;

 private:
  CameraModel camera_;
  TargetDescription target_;
  std::optional<TimePoint> not_held_since_;
  TimePoint next_look_{};
  TimePoint quiet_until_{};
  Diagnosis last_look_;
  Diagnosis said_;
};

}  // namespace tagwrench
