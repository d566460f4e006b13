// What the corner-based methods share: the lens, a tag's pose from its corners, and the geometry
// that the mean corners at rest give.
#pragma once

#include <Eigen/Geometry>
#include <array>
#include <opencv2/core.hpp>
#include <vector>

#include "host/sensor/sensor_config.h"

namespace tagwrench::bench {

using TagCorners = std::vector<cv::Point2d>;  ///< four in OpenCV's order, px; empty: not found

struct Lens {
  explicit Lens(const SensorConfig& sensor);
  cv::Matx33d matrix;
  std::vector<double> distortion;
  double tag_size;  ///< m
  std::size_t tags;
};

/// Top left, top right, bottom right, bottom left in the tag's frame (x right, y down), m.
std::array<Eigen::Vector3d, 4> square_corners(double size);

Eigen::Isometry3d isometry(const cv::Vec3d& rotation, const cv::Vec3d& translation);

/// camera_T_tag by OpenCV's IPPE for squares, the better of its two solutions.
Eigen::Isometry3d ippe_pose(const Lens& lens, const TagCorners& corners);

/// Mean corners over the rest frames, and what follows from them.
class RestCorners {
 public:
  explicit RestCorners(const Lens& lens);

  void add(const std::vector<TagCorners>& found);

  std::size_t tags() const { return sums_.size(); }
  bool learned(std::size_t tag) const { return counts_[tag] > 0; }
  const Eigen::Isometry3d& camera_T_tag(std::size_t tag) const;
  /// Midpoint of the learned tags' centres in the camera frame at rest, m.
  const Eigen::Vector3d& origin() const;

  /// The displacement that a motion of the body, now = motion * rest in camera coordinates, means.
  Vector6 displacement(const Eigen::Isometry3d& motion) const;

 private:
  void solve() const;

  Lens lens_;
  std::vector<std::array<cv::Point2d, 4>> sums_;
  std::vector<int> counts_;
  mutable std::vector<Eigen::Isometry3d> poses_;
  mutable Eigen::Vector3d origin_ = Eigen::Vector3d::Zero();
};

}  // namespace tagwrench::bench
