#include "host/wrench/estimate.h"

#include <algorithm>
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
    : model_(model),
      tool_(tool_transform(model.wrench_origin, model.camera_R_wrench_frame)),
      features_(model.features) {
  if (model.parameter_covariance.size() > 0) set_parameter_variances();
}

/// The parameters' covariance as it bears on each number put out, once and for all.
void WrenchEstimator::set_parameter_variances() {
  parameters_known_ = true;
  const auto n = model_.parameter_covariance.rows() / 6;
  for (Quadratic& q : parameter_variance_) q.setZero(n, n);
  for (Eigen::Index k = 0; k < n; ++k) {
    for (Eigen::Index l = 0; l < n; ++l) {
      const Matrix6 moved =
          tool_ * model_.parameter_covariance.block<6, 6>(6 * k, 6 * l) * tool_.transpose();
      // The lower triangle stands for both.
      for (int axis = 0; axis < 6; ++axis)
        parameter_variance_[static_cast<std::size_t>(axis)](std::max(k, l), std::min(k, l)) +=
            moved(axis, axis);
    }
  }
}

Vector6 WrenchEstimator::parameter_variance(const FeatureVector& features) const noexcept {
  Vector6 out = Vector6::Zero();
  const auto n = features.size();
  for (int axis = 0; axis < 6; ++axis) {
    const Quadratic& q = parameter_variance_[static_cast<std::size_t>(axis)];
    double sum = q(n, n);
    for (Eigen::Index l = 0; l < n; ++l) {
      double column = q(n, l);
      for (Eigen::Index k = l; k < n; ++k) column += q(k, l) * features[k];
      sum += column * features[l];
    }
    out[axis] = sum;
  }
  return out;
}

void WrenchEstimator::estimate(const Track& track, Sample& sample) noexcept {
  sample.status = track.status;
  if (track.status != Status::ok) return;
  Vector6 at_platform = model_.K * track.displacement + model_.B;
  Matrix6 tangent = model_.K;
  if (!at_platform.allFinite()) {  // before it can spoil the memory
    sample.status = Status::doubtful;
    return;
  }
  if (parameters_known_ || model_.extra.cols() > 0) {
    const double dt =
        has_last_ ? std::chrono::duration<double>(sample.capture_time - last_).count() : 0.0;
    features_.update(track.displacement, dt);
    last_ = sample.capture_time;
    has_last_ = true;
  }
  if (model_.extra.cols() > 0) {
    const auto further = features_.values().size() - 6;
    at_platform.noalias() += model_.extra.lazyProduct(features_.values().tail(further));
    tangent.noalias() += model_.extra.lazyProduct(features_.jacobian().bottomRows(further));
  }
  const Matrix6 covariance =
      tangent * track.covariance * tangent.transpose() + model_.model_covariance;
  const Matrix6 moved = tool_ * covariance * tool_.transpose();
  Vector6 variance = moved.diagonal();
  if (parameters_known_) {
    const double load = at_platform.cwiseQuotient(model_.full_load).squaredNorm();
    variance += parameter_variance(features_.values());
    variance.noalias() += load * (tool_.cwiseAbs2() * model_.error_at_full_load.cwiseAbs2()).eval();
  }
  if (!at_platform.allFinite() || !moved.allFinite()) {
    sample.status = Status::doubtful;
    return;
  }
  if ((at_platform.cwiseAbs().array() > model_.range.array()).any())
    sample.status = Status::saturated;
  sample.displacement = track.displacement;
  sample.displacement_sigma = track.covariance.diagonal().cwiseMax(0).cwiseSqrt();
  sample.wrench = tool_ * at_platform;
  sample.wrench_sigma = variance.cwiseMax(0).cwiseSqrt();
}

Vector6 WrenchEstimator::noise(const Track& track) const noexcept {
  const Matrix6 tangent = tool_ * model_.K;
  const Matrix6 covariance = tangent * track.covariance * tangent.transpose();
  return covariance.diagonal().cwiseMax(0).cwiseSqrt();
}

}  // namespace tagwrench
