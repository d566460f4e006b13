// Room tracker: pixels -> where the platform is.
// In:  Frame (grey pixels); camera, tags and rest as sensor/ has read them.
// Out: Track: displacement from rest (m, rad, along the camera's axes), its covariance, status, and
//      why the target is not held. Formulas: docs/theory.md.
// Then: photometric.h (the pose), acquire.h (without one), reference.h (rest), diagnostics.h.
//
// Frame -> displacement of the platform from rest.
//
// acquire   image -> tag corners, by OpenCV; runs only while the target is not held.
// refine    predicted pose + pixels -> pose with covariance, all tags as one rigid target.
// rest      learns the rest pose and the tags' placement from the first frames.
// diagnosis says why, while the target is not held.
#pragma once

#include <memory>

#include "host/core/types.h"
#include "host/tracker/camera_model.h"
#include "host/tracker/target.h"

namespace tagwrench {

struct KnownReference;  // tracker/diagnosis.h

class Tracker {
 public:
  Tracker(const CameraModel& camera, const TargetDescription& target, const ReferenceOptions& rest);
  ~Tracker();
  Tracker(const Tracker&) = delete;
  Tracker& operator=(const Tracker&) = delete;

  /// Never throws. Allocates only while the target is not held.
  Track track(const Frame& frame) noexcept;

  /// The rest as it was given, or as it has been learned since.
  const KnownReference& rest() const noexcept;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace tagwrench
