// Room wrench: where the platform is -> newtons.
// In:  Track: displacement (m, rad, camera axes) with its covariance; a WrenchModel of sensor/.
// Out: Sample: force and torque that the user applies, N and N m, with sigmas, about wrench_origin
//      along wrench_frame. Formulas: docs/theory.md.
// Then: zero.h (what reads while nobody touches it), fit.h (known loads -> a model).
//
// Displacement -> wrench, with covariance and a range check; the stiffness of springs.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <string_view>
#include <vector>

#include "host/core/types.h"

namespace tagwrench {

/// Moves a wrench from the origin and axes of a frame to those in which it has the pose (R, p):
/// F' = R F, M' = p x F' + R M.
Matrix6 wrench_transform(const Eigen::Matrix3d& R, const Eigen::Vector3d& p);

/// Newtons without a calibration: identical helical springs with parallel axes along platform z. A
/// spring clamped at both ends acts, for small displacements, as if it took hold of the platform at
/// its elastic centre, which by symmetry is its mid-length point: pure translation of that point
/// gives pure force, pure rotation about it gives pure torque (Wahl, Mechanical Springs, ch. 7 for
/// the lateral stiffness of compression springs).
struct Springs {
  std::vector<Eigen::Vector3d> centres;  ///< elastic centres, platform frame, m
  double axial = 700.0;                  ///< each spring, N/m
  double lateral = 70.0;                 ///< each spring, N/m
  double bending = 0.0;  ///< each spring, about x and y through its elastic centre, N m/rad
  double torsion = 0.0;  ///< each spring, about z, N m/rad
};

/// wrench = stiffness * displacement, about the platform origin at rest, camera axes; units N/m,
/// N/rad, N m/m, N m/rad.
Matrix6 stiffness(const Springs& springs);

/// What a wrench is linear in: the displacement alone, or with its products, its recent past, or
/// its turning points.
enum class FeatureKind : std::uint8_t {
  linear,      ///< d
  quadratic,   ///< d and the 21 products d_j d_k, j <= k
  creep,       ///< d and d low-passed with one time constant: a standard linear solid, whose force
               ///< is a sum of both
  hysteresis,  ///< d and the play operator of each coordinate (Visintin, Differential Models of
               ///< Hysteresis, 1994, ch. III)
};

constexpr int kFeatureKinds = 4;
constexpr int kMaxFeatures = 27;

constexpr std::array<std::string_view, kFeatureKinds> kFeatureNames{"linear", "quadratic", "creep",
                                                                    "hysteresis"};
constexpr std::string_view name(FeatureKind kind) {
  return kFeatureNames[static_cast<std::size_t>(kind)];
}

constexpr int feature_count(FeatureKind kind) {
  return kind == FeatureKind::linear ? 6 : kind == FeatureKind::quadratic ? 27 : 12;
}

struct FeatureSpec {
  FeatureKind kind = FeatureKind::linear;
  double time_constant = 0;        ///< of creep, s
  Vector6 play = Vector6::Zero();  ///< of hysteresis: half width, m, rad
};

/// The first six are the displacement.
using FeatureVector = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, kMaxFeatures, 1>;
using FeatureJacobian = Eigen::Matrix<double, Eigen::Dynamic, 6, 0, kMaxFeatures, 6>;

/// Turns one displacement after the other into features. No heap after construction.
class Features {
 public:
  explicit Features(const FeatureSpec& spec);

  /// `dt` seconds after the one before; 0 for the first, at which the memory is that of a platform
  /// that has always been at rest.
  void update(const Vector6& displacement, double dt) noexcept;
  const FeatureVector& values() const { return values_; }
  /// d values / d displacement, the past held.
  const FeatureJacobian& jacobian() const { return jacobian_; }
  void reset() noexcept;

 private:
  FeatureSpec spec_;
  Vector6 memory_ = Vector6::Zero();
  FeatureVector values_;
  FeatureJacobian jacobian_;
};

/// wrench = K d + B, or with further features K d + extra phi + B; then moved to where the user
/// wants it.
struct WrenchModel {
  Matrix6 K = Matrix6::Zero();                 ///< N/m, N/rad, N m/m, N m/rad
  Vector6 B = Vector6::Zero();                 ///< N, N m
  Vector6 range = Vector6::Constant(1e9);      ///< calibrated, +- N, N m, before the tool transform
  Matrix6 model_covariance = Matrix6::Zero();  ///< of the model's error at rest, N and N m squared
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
