// What a description of a lens must hold to, whoever wrote it.
#pragma once

#include <Eigen/Core>
#include <optional>

#include "host/tracker/camera_model.h"

namespace tagwrench {

inline constexpr double kMaxFocal_px = 1e6;
inline constexpr double kFarthestCentre_px = 1e5;

/// Where the distortion folds the image, px: looking outward, its pixels begin to show again what
/// they have shown nearer to the centre. Empty where they never do.
std::optional<Eigen::Vector2d> fold(const CameraModel& camera);

}  // namespace tagwrench
