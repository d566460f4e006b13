// Corners of the target's tags: its pose from those that were found, and where a pose puts them.
#pragma once

#include <optional>
#include <vector>

#include "host/tracker/acquire.h"

namespace tagwrench {

/// Minimises the reprojection error of all corners together. Starts from every pose that any tag
/// alone allows and from the reference pose, and keeps the best end within reach of it: a
/// flipped solution never does. Empty when none is left.
std::optional<Eigen::Isometry3d> pose_from_corners(
    const CameraModel& camera, double tag_size, const std::vector<FoundTag>& found,
    const std::vector<Eigen::Isometry3d>& platform_T_tag, const Eigen::Isometry3d& reference);

/// Is the pose one that a platform on springs can reach from rest?
bool within_reach(const Eigen::Isometry3d& reference, const Eigen::Isometry3d& camera_T_platform);

/// Fills `corners` and `corner_count` of the track: one entry for each tag of the target, in its
/// order. `platform_T_tag` is as long as the target's tags, or nothing is filled; nor is it where a
/// corner would lie behind the lens. No heap.
void set_corners(const CameraModel& camera, const TargetDescription& target,
                 const std::vector<Eigen::Isometry3d>& platform_T_tag,
                 const Eigen::Isometry3d& camera_T_platform, Track& track) noexcept;

}  // namespace tagwrench
