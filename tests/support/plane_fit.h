// The pose of one printed tag from all of its ink: least squares between the picture and the tag's
// pattern, blurred and lit.
#pragma once

#include <Eigen/Geometry>
#include <opencv2/core.hpp>

namespace tagwrench::test {

/// Improves `camera_T_tag` (tag axes: x right, y down, m), good to a pixel or two beforehand.
/// `cells` is the pattern as printed, black frame included, one element a cell: 0 = ink (CV_8U).
/// `size` is the black square's edge, m; `camera` is K, px, without distortion. Paper's brightness
/// may fall off linearly across the tag; the picture is grey (CV_8U).
Eigen::Isometry3d fit_tag_plane(const cv::Mat& picture, const Eigen::Matrix3d& camera,
                                const cv::Mat& cells, double size,
                                const Eigen::Isometry3d& camera_T_tag);

}  // namespace tagwrench::test
