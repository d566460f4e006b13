// The normal equations of the bundle adjustment, their solution in two eliminations, and the
// derivatives in them: how what a picture shows of one edge point changes with all that is unknown
// about it.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "host/core/types.h"
#include "host/tracker/camera_model.h"
#include "host/tracker/edges.h"

namespace tagwrench {

/// How the offset of one edge point (px, along its normal in the image) changes.
struct EdgeDerivatives {
  Vector6 frame = Vector6::Zero();  ///< with a motion of the platform (rotation.h), px/m and px/rad
  Vector6 tag = Vector6::Zero();    ///< with a motion of the tag at rest, camera axes, alike
  double normal = 0;                ///< with a shift of the edge in the tag's plane, px/m
  double focal = 0;                 ///< with the logarithm of the focal length, px
  double readout = 0;               ///< with the read-out time, px/s; the caller's to fill in
  double row_px = 0;                ///< where the point is seen
};

/// `camera_T_platform` in this picture and at rest; `camera_T_tag` at rest; `point` in tag axes, m.
EdgeDerivatives edge_derivatives(const CameraModel& camera, const EdgeMeasurement& measurement,
                                 const Eigen::Isometry3d& camera_T_platform,
                                 const Eigen::Isometry3d& rest_camera_T_platform,
                                 const Eigen::Isometry3d& camera_T_tag,
                                 const Eigen::Vector3d& point);

/// One offset of an edge: offset = derivatives . unknowns + noise.
struct EdgeEquation {
  int frame = -1;  ///< keyframe; -1: the rest image, whose pose is no unknown
  int tag = 0;
  Eigen::Index point = 0;
  EdgeDerivatives by;
  double offset = 0;
  double weight = 0;  ///< 1 / variance
};

/// Unknowns: 6 for each keyframe; one for each point; and the shared ones, in the order 6 for each
/// tag, the print modes of each tag, the read-out time, the focal length's logarithm. SI.
class TargetNormal {
 public:
  TargetNormal(int frames, int tags, Eigen::Index points);

  void add(const EdgeEquation& equation);
  /// shift - row . modes of the tag's print = offset + noise
  void add_print(Eigen::Index point, int tag, const PrintModes& row, double offset, double weight);
  /// The sum of all tags' sizes = offset + noise
  void add_total_size(double offset, double weight);
  /// A shared unknown, by its index = offset + noise
  void add_prior(Eigen::Index shared, double offset, double weight);

  /// Eliminates points and keyframes; false if the equations do not determine the keyframes. Once.
  bool reduce();

  // After reduce().

  /// Of the shared unknowns, all else unknown.
  Eigen::MatrixXd information() const;
  /// Solves for the shared unknowns; the focal length stays as it is unless `free_focal`. Empty if
  /// they are not determined.
  Eigen::VectorXd shared_step(bool free_focal) const;
  /// What the shared step means for the keyframes (6 each) and the points.
  Eigen::VectorXd frame_steps(const Eigen::VectorXd& shared) const;
  Eigen::VectorXd point_steps(const Eigen::VectorXd& shared, const Eigen::VectorXd& frames) const;

  /// What a pull on keyframes (6 each) and shared unknowns means for the shared ones, the keyframes
  /// having given way.
  Eigen::VectorXd reduced_pull(const Eigen::VectorXd& pull) const;
  /// And what a pull on a point means for both.
  Eigen::VectorXd point_pull(Eigen::Index point, double pull) const;
  Eigen::Index keyframe_unknowns() const noexcept { return moving_; }

  Eigen::Index shared_count() const noexcept { return shared_; }
  /// The first of the tag's print modes.
  Eigen::Index print_index(int tag) const noexcept { return 6 * tags_ + kPrintModes * tag; }
  Eigen::Index readout_index() const noexcept { return shared_ - 2; }
  Eigen::Index focal_index() const noexcept { return shared_ - 1; }

 private:
  Eigen::Index tags_;
  Eigen::Index moving_;  // unknowns of the keyframes
  Eigen::Index shared_;
  Eigen::VectorXd units_;     // of keyframes, then shared: brings the unknowns to like size
  Eigen::MatrixXd normal_;    // keyframes, then shared; lower half
  Eigen::VectorXd right_;     // alike
  Eigen::MatrixXd coupling_;  // one column for each point
  Eigen::VectorXd pivot_;     // of each point
  Eigen::VectorXd pull_;      // of each point
  Eigen::MatrixXd reduced_;   // shared x shared
  Eigen::VectorXd reduced_right_;
};

}  // namespace tagwrench
