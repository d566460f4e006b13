// Frame -> displacement of the platform from its reference pose.
//
// In    8-bit luminance with its capture time, the camera's model (px), the target's tags (m), and
//       what is already known of the reference: pose, placement, picture.
// Out   a Track: displacement (m, rad, camera axes) with its covariance, the tags' corners (px),
//       the region that the next frame must show, and a diagnostic if there is something to say.
//
// learn     the first frames at rest -> reference pose, tags' placement, averaged picture
//           (reference.h), and of the picture a template (pixel_template.h)
// predict   constant velocity (rotation.h)
// align     prediction + pixels -> pose: photometric alignment with the template, six motions with
//           illumination and blur (photometric.h)
// refine    where that fails, or while there is no template: model-based edges from the prediction
//           (edges.h), then tags by OpenCV (acquire.h), near where they were and then in the
//           whole image, edges, and alignment once more
// conclude  covariance: noise and residuals, the tags' placement (photometric.h), and
//           where the reference pose was given, that of the picture
// diagnose  what a person should know (diagnostics.h)
#pragma once

#include <memory>
#include <string>

#include "host/core/types.h"
#include "host/tracker/camera_model.h"
#include "host/tracker/target.h"

namespace tagwrench {

enum class TrackingState : std::uint8_t {
  learning_reference,
  searching,        ///< the reference is known, but the target has not been seen yet
  held_by_edges,    ///< no picture at rest yet
  held_by_picture,  ///< aligned with the template
  lost,             ///< was held
};

/// A diagnostic as one line for people: what is seen, where, and what to do.
std::string diagnostic_text(Diagnostic diagnostic, const DiagnosticDetails& details);

class Tracker {
 public:
  Tracker(const CameraModel& camera, const TargetDescription& target,
          const ReferenceOptions& reference);
  ~Tracker();
  Tracker(const Tracker&) = delete;
  Tracker& operator=(const Tracker&) = delete;

  /// Never throws. Allocates only while the target is not held by its picture.
  Track track(const Frame& frame) noexcept;

  /// The reference as it was given, or as it has been learned since.
  const KnownReference& reference() const noexcept;
  TrackingState state() const noexcept;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace tagwrench
