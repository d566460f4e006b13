// The normal equations of target_adjust.h and their solution in two eliminations.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "host/core/types.h"

namespace tagwrench {

/// One offset of an edge: offset = derivatives . unknowns + noise.
struct EdgeEquation {
  int frame = -1;  ///< keyframe; -1: the rest image, whose pose is no unknown
  int tag = 0;
  Eigen::Index point = 0;
  Vector6 by_frame = Vector6::Zero();
  Vector6 by_tag = Vector6::Zero();
  double by_normal = 0;
  double by_readout = 0;
  double by_focal = 0;
  double offset = 0;
  double weight = 0;  ///< 1 / variance
};

/// Unknowns: 6 for each keyframe; one for each point; and the shared ones, in the order 6 for each
/// tag, one ink spread for each tag, the read-out time, the focal length's logarithm. SI.
class TargetNormal {
 public:
  TargetNormal(int frames, int tags, Eigen::Index points);

  void add(const EdgeEquation& equation);
  /// shift - spread of the tag = offset + noise
  void add_print(Eigen::Index point, int tag, double offset, double weight);
  /// spread of the tag = offset + noise
  void add_spread(int tag, double offset, double weight) {
    add_prior(moving_ + spread_index(tag), offset, weight);
  }
  /// read-out time = offset + noise
  void add_readout(double offset, double weight) {
    add_prior(moving_ + readout_index(), offset, weight);
  }

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

  Eigen::Index shared_count() const noexcept { return shared_; }
  Eigen::Index spread_index(int tag) const noexcept { return 6 * tags_ + tag; }
  Eigen::Index readout_index() const noexcept { return shared_ - 2; }
  Eigen::Index focal_index() const noexcept { return shared_ - 1; }

 private:
  void add_prior(Eigen::Index at, double offset, double weight);

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
