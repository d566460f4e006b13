// Whether a loaded picture of the sensor at rest shows this target at its reference pose.
#pragma once

#include <optional>

#include "host/tracker/camera_model.h"
#include "host/tracker/target.h"

namespace tagwrench {

struct AppearanceMismatch {
  int id = 0;  ///< of the tag that is not where the poses put it
  /// Correlation of the picture's grey levels with the tag's cells, -1 to 1; of a picture that is
  /// flat there, zero.
  double likeness = 0;
};

/// The first tag whose cells the picture does not show. Empty where all are shown, and where
/// nothing can be said: without a picture, a reference pose or the tags' places.
std::optional<AppearanceMismatch> check_appearance(const CameraModel& camera,
                                                   const TargetDescription& target,
                                                   const ReferenceOptions& reference);

}  // namespace tagwrench
