#include "host/wrench/estimate.h"

#include <cmath>

namespace tagwrench {
namespace {

/// F' = R^T F; M' = R^T (M - o x F): the same load, its moment taken about o, along the axes of R.
Matrix6 tool_transform(const Eigen::Vector3d& o, const Eigen::Matrix3d& camera_R_frame) {
  Eigen::Matrix3d ox;
  ox << 0, -o.z(), o.y(), o.z(), 0, -o.x(), -o.y(), o.x(), 0;
  const Eigen::Matrix3d R = camera_R_frame.transpose();
  Matrix6 m = Matrix6::Zero();
  m.topLeftCorner<3, 3>() = R;
  m.bottomRightCorner<3, 3>() = R;
  m.bottomLeftCorner<3, 3>() = -R * ox;
  return m;
}

}  // namespace

WrenchEstimator::WrenchEstimator(const WrenchModel& model)
    : model_(model), tool_(tool_transform(model.wrench_origin, model.camera_R_wrench_frame)) {}

void WrenchEstimator::estimate(const Track& track, Sample& sample) const noexcept {
  sample.status = track.status;
  if (track.status != Status::ok) return;
  const Vector6 at_platform = model_.K * track.displacement + model_.B;
  const Matrix6 covariance =
      model_.K * track.covariance * model_.K.transpose() + model_.model_covariance;
  const Matrix6 moved = tool_ * covariance * tool_.transpose();
  if (!at_platform.allFinite() || !moved.allFinite()) {
    sample.status = Status::doubtful;
    return;
  }
  if ((at_platform.cwiseAbs().array() > model_.range.array()).any())
    sample.status = Status::saturated;
  sample.displacement = track.displacement;
  sample.displacement_sigma = track.covariance.diagonal().cwiseMax(0).cwiseSqrt();
  sample.wrench = tool_ * at_platform;
  sample.wrench_sigma = moved.diagonal().cwiseMax(0).cwiseSqrt();
}

}  // namespace tagwrench
