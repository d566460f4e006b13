// What it costs not to know exactly where the tags sit: a displacement d is read with an error that
// grows with d.
#pragma once

#include <array>
#include <vector>

#include "host/tracker/photometric.h"

namespace tagwrench {

/// First-order propagation: error = (sum over axes j of d_j * slope_j) * (error of the tags' poses
/// at rest). The tags' planes turn or shift while what they show in the picture at rest stays where
/// it is.
class GeometryUncertainty {
 public:
  /// `tag_covariance`: of each tag's motion in the platform frame at rest (camera axes; m, rad; see
  /// rotation.h), with the spread of placement as its cause. `origin_follows`: the platform's
  /// origin is the mean of the tags' centres, so that it moves with their errors. Differentiates
  /// numerically; allocates.
  void set(PhotometricAligner& aligner, const Eigen::Isometry3d& camera_T_platform,
           std::vector<Matrix6> tag_covariance, bool origin_follows);

  /// Of a displacement (m, rad) read from the image. No heap.
  Matrix6 covariance(const Vector6& displacement) const noexcept;

 private:
  struct TagPart {
    std::array<Matrix6, 6> slope;  ///< per axis of displacement; columns: the tag's six errors,
                                   ///< each by one standard deviation along a principal axis
  };
  std::vector<TagPart> tags_;
};

}  // namespace tagwrench
