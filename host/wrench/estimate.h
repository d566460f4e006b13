// Displacement -> wrench, with covariance and a range check.
#pragma once

#include <Eigen/Core>

#include "host/types.h"

namespace tagwrench {

/// wrench = K d + B, then moved to where the user wants it.
struct WrenchModel {
  Matrix6 K = Matrix6::Zero();  ///< N/m, N/rad, N m/m, N m/rad
  Vector6 B = Vector6::Zero();  ///< N, N m
  Vector6 range =
      Vector6::Constant(1e9);  ///< calibrated range, +- N, N m, before the tool transform
  Matrix6 model_covariance = Matrix6::Zero();  ///< of the fit itself, N^2, N N m, N^2 m^2
  Eigen::Vector3d wrench_origin = Eigen::Vector3d::Zero();  ///< platform frame at rest, m
  Eigen::Matrix3d camera_R_wrench_frame = Eigen::Matrix3d::Identity();  ///< axes of wrench_frame
};

class WrenchEstimator {
 public:
  explicit WrenchEstimator(const WrenchModel& model);

  /// Fills sample.status, displacement, wrench and their sigmas from the track. Numbers stay zero
  /// unless the track's status is ok. No heap.
  void estimate(const Track& track, Sample& sample) const noexcept;

 private:
  WrenchModel model_;
  Matrix6 tool_;  ///< moves a wrench to wrench_origin and turns it into wrench_frame
};

}  // namespace tagwrench
