// The poses that a square's four corners allow (Collins and Bartoli, "Infinitesimal plane-based
// pose estimation", IJCV 109, 2014).
#pragma once

#include <Eigen/Geometry>
#include <vector>

#include "host/tracker/camera_model.h"
#include "host/tracker/square_finder.h"

namespace tagwrench {

/// From a plane in which the square's corners lie at +-1, x right, y down, to where they are; its
/// last number is 1. Not finite for corners in a line.
Eigen::Matrix3d square_homography(const Square& corners);

/// camera_T_tag, one or two, smaller reprojection error first. Seen from behind or behind the lens:
/// left out. `size` is the edge of the square, m.
std::vector<Eigen::Isometry3d> square_poses(const CameraModel& camera, double size,
                                            const Square& corners);

}  // namespace tagwrench
