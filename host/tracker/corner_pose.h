// The pose of the whole rigid target from the corners of those tags that were found.
#pragma once

#include <optional>
#include <vector>

#include "host/tracker/acquire.h"

namespace tagwrench {

/// Minimises the reprojection error of all corners together. Starts from every pose that any tag
/// alone allows and from the rest pose, and keeps the best end that lies within reach of rest: a
/// flipped solution never does. Empty when none is left.
std::optional<Eigen::Isometry3d> pose_from_corners(
    const CameraModel& camera, double tag_size, const std::vector<FoundTag>& found,
    const std::vector<Eigen::Isometry3d>& platform_T_tag,
    const Eigen::Isometry3d& rest_camera_T_platform);

/// Is the pose one that a platform on springs can reach from rest?
bool within_reach(const Eigen::Isometry3d& rest_camera_T_platform,
                  const Eigen::Isometry3d& camera_T_platform);

}  // namespace tagwrench
