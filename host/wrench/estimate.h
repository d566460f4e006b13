// Room wrench: where the platform is -> newtons.
// In:  Track: displacement (m, rad, camera axes) with its covariance; a WrenchModel of sensor/.
// Out: Sample: force and torque that the user applies, N and N m, with sigmas, about wrench_origin
//      along wrench_frame. Formulas: docs/theory.md.
// Then: zero.h (what reads hands off), spring_model.h, fit.h (known loads -> a model).
//
// Displacement -> wrench, with covariance and a range check.
#pragma once

#include <Eigen/Core>
#include <array>

#include "host/core/types.h"
#include "host/wrench/features.h"

namespace tagwrench {

/// wrench = K d + B, or with further features K d + extra phi + B; then moved to where the user
/// wants it.
struct WrenchModel {
  Matrix6 K = Matrix6::Zero();  ///< N/m, N/rad, N m/m, N m/rad
  Vector6 B = Vector6::Zero();  ///< N, N m
  Vector6 range =
      Vector6::Constant(1e9);  ///< calibrated range, +- N, N m, before the tool transform
  Matrix6 model_covariance =
      Matrix6::Zero();  ///< of the model's error at rest, N^2, N N m, N^2 m^2
  Eigen::Vector3d wrench_origin = Eigen::Vector3d::Zero();  ///< platform frame at rest, m
  Eigen::Matrix3d camera_R_wrench_frame = Eigen::Matrix3d::Identity();  ///< axes of wrench_frame

  FeatureSpec features;
  Eigen::Matrix<double, 6, Eigen::Dynamic, 0, 6, kMaxFeatures - 6> extra =
      Eigen::Matrix<double, 6, Eigen::Dynamic, 0, 6, kMaxFeatures - 6>::Zero(6, 0);
  /// Of the fit: (K, extra, B) column by column, 6 (features + 1) square; empty: not known.
  Eigen::MatrixXd parameter_covariance;
  Vector6 error_at_full_load = Vector6::Zero();  ///< standard deviation that grows with the load,
                                                 ///< N, N m at a load of one
  Vector6 full_load = Vector6::Constant(1e9);    ///< load = |wrench / full_load|, N, N m
};

class WrenchEstimator {
 public:
  explicit WrenchEstimator(const WrenchModel& model);

  /// Fills sample.status, displacement, wrench and their sigmas from the track; sample.capture_time
  /// carries the model's memory, if it has one. Numbers stay zero unless the track's status is ok.
  /// No heap.
  void estimate(const Track& track, Sample& sample) noexcept;

  /// One standard deviation of what the tracker's noise alone makes of sample.wrench, N, N m.
  Vector6 noise(const Track& track) const noexcept;

  /// A wrench about the platform's origin along camera axes -> as the user wants it.
  const Matrix6& tool() const noexcept { return tool_; }

 private:
  using Quadratic =
      Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, kMaxFeatures + 1, kMaxFeatures + 1>;

  void set_parameter_variances();
  Vector6 parameter_variance(const FeatureVector& features) const noexcept;

  WrenchModel model_;
  Matrix6 tool_;  ///< moves a wrench to wrench_origin and turns it into wrench_frame
  Features features_;
  TimePoint last_{};
  bool has_last_ = false;
  bool parameters_known_ = false;
  std::array<Quadratic, 6> parameter_variance_;  ///< of each number put out: (phi, 1)^T Q (phi, 1)
};

}  // namespace tagwrench
