// Bundle adjustment of the tags' placement: where each tag sits at rest, from the rest image and
// pictures of the target in motion.
//
// Unknowns  camera_T_tag at rest for each tag; how each tag is printed as a whole (ink spread,
//           size, aspect, shear: PrintModes); for every edge point how far its edge lies off the
//           printed pattern (along its normal, in the tag's plane);
//           the displacement in every keyframe; the time that the camera takes from its first
//           row to its last, while the target moves on; the focal length's error, if asked.
// Data      the offsets of all edge points in the rest image and in all keyframes, px.
// Prior     the edges lie about the pattern as that tag printed it, with a scatter that is
//           estimated, and the tags together are as large as said. That gives the scale, and all
//           that the rest image can tell about the planes; the rest comes from parallax, which
//           knows nothing of the print.
//
// Gauss-Newton. The points, one number each, are eliminated first, then the keyframes, six numbers
// each (Schur complements), which leaves the few numbers that are wanted and their information
// matrix. Compare Triggs et al., "Bundle adjustment - a modern synthesis", 2000, sections 6 and 9.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <functional>
#include <limits>
#include <vector>

#include "host/core/types.h"
#include "host/tracker/camera_model.h"
#include "host/tracker/edges.h"
#include "host/tracker/target.h"

namespace tagwrench {

/// What is known before the motion, and what after it, of the same parameters.
struct TargetEstimate {
  std::vector<Eigen::Isometry3d> camera_T_tag;  ///< at rest
  std::vector<PrintModes> print;                ///< of each tag
  /// Of all tags' motions at rest (6 numbers each: m, rad, camera axes), the focal length taken as
  /// given.
  Eigen::MatrixXd covariance;
  Eigen::MatrixXd covariance_at_rest;  ///< the same from the rest image alone
  double readout = 0;                  ///< from the first row to the last, s
  double readout_sigma = 0;            ///< s
  /// By how much of an edge's variance the fit would be worse without the read-out time.
  double readout_gain = 0;
  double focal_ratio = 1;  ///< that fits best, to the camera's
  /// Of the ratio; infinite where the motion does not tell it.
  double focal_sigma = std::numeric_limits<double>::infinity();
  double noise_px = 0;       ///< of one edge in one keyframe
  double residual_px = 0;    ///< RMS over all edges of all keyframes, outliers included
  double print_scatter = 0;  ///< of the edges about the tags' patterns as printed, m
  int points = 0;            ///< edge points in use
  bool solved = false;       ///< false: the equations had no solution
};

/// The rest image and where the tags are in it, nearly right.
struct TargetAtRest {
  CameraModel camera;
  ReferenceImage image;
  std::vector<TagPattern> patterns;
  std::vector<Eigen::Isometry3d> camera_T_tag;
};

/// One picture of the moved target, flipped back where the camera mirrors it.
struct Keyframe {
  Vector6 displacement = Vector6::Zero();  ///< from rest, as tracked: m, rad (types.h)
  Vector6 velocity = Vector6::Zero();      ///< m/s, rad/s along the camera's axes
  int first_row = 0;                       ///< of the crop in the image
  int image_rows = 1;                      ///< of the whole image
  CameraModel camera;                ///< of the crop: the principal point counts from its corner
  std::vector<std::uint8_t> pixels;  ///< no padding

  PixelView<std::uint8_t> view() const {
    return {pixels.data(), camera.width_px, camera.height_px, camera.width_px};
  }
};

/// `frames` carry displacements of the platform whose origin at rest is the midpoint of the given
/// tag centres. `progress` is told the share that is done, 0..1; false from it gives up (not
/// solved).
TargetEstimate adjust_target(const TargetAtRest& rest, const std::vector<Keyframe>& frames,
                             const std::function<bool(double)>& progress = {});

}  // namespace tagwrench
