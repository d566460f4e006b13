// Where a pose puts the corners of the target's tags in the image.
#pragma once

#include <Eigen/Geometry>
#include <vector>

#include "host/core/types.h"
#include "host/tracker/camera_model.h"
#include "host/tracker/target.h"

namespace tagwrench {

/// Fills `corners` and `corner_count` of the track: one entry for each tag of the target, in its
/// order. `platform_T_tag` is as long as the target's tags, or nothing is filled; nor is it where a
/// corner would lie behind the lens. No heap.
void set_corners(const CameraModel& camera, const TargetDescription& target,
                 const std::vector<Eigen::Isometry3d>& platform_T_tag,
                 const Eigen::Isometry3d& camera_T_platform, Track& track) noexcept;

}  // namespace tagwrench
