// Room calibration/target: the platform at rest and moved about -> where its tags sit.
// In:  frames of a source; the camera as calibrated.
// Out: each tag's pose in the platform frame (m, rad) with sigmas, the rest pose in the
//      camera frame, the picture at rest, the shutter's read-out (s).
// Then: adjust.h (the least squares), keyframes.h, verdict.h (what a recording cannot tell).
//
// From a source's frames to what a calibration of the target works on: first the platform at rest,
// then in motion.
#pragma once

#include <memory>

#include "host/calibration/target/adjust.h"
#include "host/calibration/target/keyframes.h"
#include "host/core/types.h"
#include "host/tracker/target.h"

namespace tagwrench {

class TargetRecorder {
 public:
  /// Placement and rest pose that `target` and `rest` may give are set aside: they are what is to
  /// be found. Throws ConfigError for a target that cannot be tracked.
  TargetRecorder(const CameraModel& camera, const TargetDescription& target,
                 const ReferenceOptions& rest, std::size_t most_keyframes);
  ~TargetRecorder();
  TargetRecorder(const TargetRecorder&) = delete;
  TargetRecorder& operator=(const TargetRecorder&) = delete;

  /// What the tracker says about it. Never throws for what a frame shows.
  Track add(const Frame& frame);

  bool rest_known() const noexcept;
  /// Once rest_known().
  const TargetAtRest& at_rest() const noexcept;
  const std::vector<Keyframe>& keyframes() const noexcept;

  struct Counts {
    int frames = 0;          ///< all
    int most_tags_seen = 0;  ///< in one frame, before the rest is known
    int moved = 0;           ///< restarts of the rest because the platform moved
    int moving = 0;          ///< frames since the rest is known
    int followed = 0;        ///< of these, with all tags held
    bool flipped = false;    ///< tags decode only in the image flipped the other way
  };
  const Counts& counts() const noexcept;

  /// From the smallest to the largest displacement that was followed, m and rad.
  Vector6 range() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace tagwrench
