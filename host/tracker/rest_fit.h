// One picture of a target at rest: where its tags are, how they are printed, and how well that is
// known.
#pragma once

#include <Eigen/Geometry>
#include <cmath>
#include <vector>

#include "host/tracker/edges.h"

namespace tagwrench {

/// A rigid body of tags as seen at rest.
struct RestFit {
  Eigen::Isometry3d camera_T_platform = Eigen::Isometry3d::Identity();
  Matrix6 covariance = Matrix6::Zero();  ///< of its motion, camera axes, m and rad
  std::vector<PrintModes> print;         ///< of each tag
  double scatter = 0;                    ///< of the edges about pattern and print, m

  /// Of the ink, mean over the tags, m.
  double spread() const {
    double sum = 0;
    for (const PrintModes& tag : print) sum += std::abs(tag[0]);
    return sum / static_cast<double>(print.size());
  }
};

/// Fits the platform's pose together with how each tag (of `size`, m) is printed as a whole, from a
/// start in `fit`, and moves the tags' edge points accordingly. Interior cells shrink where the
/// outer square grows, which is what separates spread from distance; perspective separates aspect
/// and shear from tilt, as far as it goes; for the rest stands what prints usually do
/// (print_prior()). Fills the covariance from what the residuals say and what this print may do
/// (print_sigma()). False when the fit fails.
bool fit_pose_and_print(const EdgeMeter& meter, const PixelView<float>& image, double size,
                        EdgeTarget& target, RestFit& fit);

/// Moves every point onto its own edge as seen at rest, drops points that have none, and notes
/// contrasts and the cells' grey levels. From then on the fit at rest is exact and tracking
/// measures changes only, so that ragged print costs little. False when too few points are left.
bool learn_appearance(const EdgeMeter& meter, const PixelView<float>& image, EdgeTarget& target,
                      const Eigen::Isometry3d& camera_T_platform);

}  // namespace tagwrench
