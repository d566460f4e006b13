// Learning how the target's edges really look at rest: ink spread, ragged print, contrast and
// light.
#pragma once

#include "host/tracker/edge_measure.h"

namespace tagwrench {

/// Fits the platform's pose together with one ink spread for each tag (the distance by which black
/// has grown on all sides) and moves the tags' edge points by it. Interior cells shrink where the
/// outer square grows, which is what separates spread from distance. Fills the covariance of the
/// pose (its motion, camera axes, m and rad) from what the residuals say. False when the fit fails.
bool fit_pose_and_spread(const EdgeMeter& meter, const PixelView<float>& image, EdgeTarget& target,
                         Eigen::Isometry3d& camera_T_platform, Matrix6& covariance);

/// Moves every point onto its own edge as seen at rest, drops points that have none, and notes
/// contrasts and the cells' grey levels. From then on the fit at rest is exact and tracking
/// measures changes only, so that ragged print costs little. False when too few points are left.
bool learn_appearance(const EdgeMeter& meter, const PixelView<float>& image, EdgeTarget& target,
                      const Eigen::Isometry3d& camera_T_platform);

}  // namespace tagwrench
