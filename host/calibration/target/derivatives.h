// How what a picture shows of one edge point changes with all that is unknown about it.
#pragma once

#include <Eigen/Geometry>

#include "host/tracker/camera_model.h"
#include "host/tracker/edge_measure.h"

namespace tagwrench {

/// How the offset of one edge point (px, along its normal in the image) changes.
struct EdgeDerivatives {
  Vector6 frame = Vector6::Zero();  ///< with a motion of the platform (rotation.h), px/m and px/rad
  Vector6 tag = Vector6::Zero();    ///< with a motion of the tag at rest, camera axes, alike
  double normal = 0;                ///< with a shift of the edge in the tag's plane, px/m
  double focal = 0;                 ///< with the logarithm of the focal length, px
  double row_px = 0;                ///< where the point is seen
};

/// `camera_T_platform` in this picture and at rest; `camera_T_tag` at rest; `point` in tag axes, m.
EdgeDerivatives edge_derivatives(const CameraModel& camera, const EdgeMeasurement& measurement,
                                 const Eigen::Isometry3d& camera_T_platform,
                                 const Eigen::Isometry3d& rest_camera_T_platform,
                                 const Eigen::Isometry3d& camera_T_tag,
                                 const Eigen::Vector3d& point);

}  // namespace tagwrench
