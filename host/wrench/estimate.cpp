#include "host/wrench/estimate.h"

#include <algorithm>
#include <cmath>

namespace tagwrench {

Matrix6 wrench_transform(const Eigen::Matrix3d& R, const Eigen::Vector3d& p) {
  Eigen::Matrix3d px;
  px << 0, -p.z(), p.y(), p.z(), 0, -p.x(), -p.y(), p.x(), 0;
  Matrix6 m = Matrix6::Zero();
  m.topLeftCorner<3, 3>() = R;
  m.bottomRightCorner<3, 3>() = R;
  m.bottomLeftCorner<3, 3>() = px * R;
  return m;
}

WrenchEstimator::WrenchEstimator(const WrenchModel& model)
    : model_(model),
      tool_(wrench_transform(model.camera_R_wrench_frame.transpose(),
                             -model.camera_R_wrench_frame.transpose() * model.wrench_origin)),
      features_(model.features) {
  // The parameters' covariance as it bears on each number put out, once and for all.
  parameters_known_ = model.parameter_covariance.size() > 0;
  if (!parameters_known_) return;
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

Features::Features(const FeatureSpec& spec)
    : spec_(spec),
      values_(FeatureVector::Zero(feature_count(spec.kind))),
      jacobian_(FeatureJacobian::Zero(feature_count(spec.kind), 6)) {
  jacobian_.topRows<6>().setIdentity();
}

void Features::reset() noexcept {
  memory_.setZero();
  values_.setZero();
}

void Features::update(const Vector6& displacement, double dt) noexcept {
  values_.head<6>() = displacement;
  switch (spec_.kind) {
    case FeatureKind::linear: return;
    case FeatureKind::quadratic: {
      int row = 6;
      for (int j = 0; j < 6; ++j) {
        for (int k = j; k < 6; ++k, ++row) {
          values_[row] = displacement[j] * displacement[k];
          jacobian_.row(row).setZero();
          jacobian_(row, j) += displacement[k];
          jacobian_(row, k) += displacement[j];
        }
      }
      return;
    }
    case FeatureKind::creep: {
      // Exact for a displacement that is constant over dt.
      const double gain = dt > 0 ? -std::expm1(-dt / spec_.time_constant) : 0.0;
      memory_ += gain * (displacement - memory_);
      values_.tail<6>() = memory_;
      jacobian_.bottomRows<6>().diagonal().setConstant(gain);
      return;
    }
    case FeatureKind::hysteresis: {
      for (int j = 0; j < 6; ++j) {
        const double before = memory_[j];
        memory_[j] =
            std::clamp(before, displacement[j] - spec_.play[j], displacement[j] + spec_.play[j]);
        jacobian_(6 + j, j) = memory_[j] == before ? 0.0 : 1.0;
      }
      values_.tail<6>() = memory_;
      return;
    }
  }
}

Matrix6 stiffness(const Springs& springs) {
  Vector6 own;
  own << springs.lateral, springs.lateral, springs.axial, springs.bending, springs.bending,
      springs.torsion;
  Matrix6 sum = Matrix6::Zero();
  for (const Eigen::Vector3d& p : springs.centres) {
    // The spring's wrench about its centre, moved to the origin; motions go the other way, by the
    // transpose.
    const Matrix6 move = wrench_transform(Eigen::Matrix3d::Identity(), p);
    sum += move * own.asDiagonal() * move.transpose();
  }
  return sum;
}

}  // namespace tagwrench
