#include "host/calibration/target/derivatives.h"

#include <Eigen/LU>

#include "host/tracker/projection.h"

namespace tagwrench {

EdgeDerivatives edge_derivatives(const CameraModel& camera, const EdgeMeasurement& measurement,
                                 const Eigen::Isometry3d& camera_T_platform,
                                 const Eigen::Isometry3d& rest_camera_T_platform,
                                 const Eigen::Isometry3d& camera_T_tag,
                                 const Eigen::Vector3d& point) {
  EdgeDerivatives by;
  by.frame = measurement.row;
  by.normal = measurement.px_per_m;
  // A motion (t, r) of the tag at rest moves the point by t + r x arm at rest, and by that turned
  // in the picture.
  const Eigen::Matrix3d turn =
      camera_T_platform.linear() * rest_camera_T_platform.linear().transpose();
  const Eigen::Vector3d pull = turn.transpose() * measurement.row.head<3>();
  const Eigen::Vector3d arm = camera_T_tag.linear() * point;
  by.tag << pull, arm.cross(pull);
  // measurement.row begins with J^T n, n the direction of the profile and J the projection's
  // derivative; the image grows about the principal point.
  const Eigen::Vector3d p =
      camera_T_platform * (rest_camera_T_platform.inverse() * (camera_T_tag * point));
  const ProjectedPoint seen = project(camera, p);
  const Eigen::Matrix2d square = seen.jacobian * seen.jacobian.transpose();
  const Eigen::Vector2d direction = square.inverse() * (seen.jacobian * measurement.row.head<3>());
  by.focal = direction.dot(seen.pixel - Eigen::Vector2d(camera.cx_px, camera.cy_px));
  by.row_px = seen.pixel.y();
  return by;
}

}  // namespace tagwrench
