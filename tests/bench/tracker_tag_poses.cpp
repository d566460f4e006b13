#include "tests/bench/tracker_tag_poses.h"

#include <algorithm>
#include <opencv2/calib3d.hpp>

namespace tagwrench::bench {

Lens::Lens(const SensorConfig& sensor)
    : matrix(sensor.camera.fx_px, 0, sensor.camera.cx_px, 0, sensor.camera.fy_px,
             sensor.camera.cy_px, 0, 0, 1),
      distortion(sensor.camera.distortion.begin(), sensor.camera.distortion.end()),
      tag_size(sensor.target.tag_size),
      tags(sensor.target.tags.size()) {}

std::array<Eigen::Vector3d, 4> square_corners(double size) {
  const double h = 0.5 * size;
  return {{{-h, -h, 0}, {h, -h, 0}, {h, h, 0}, {-h, h, 0}}};
}

Eigen::Isometry3d isometry(const cv::Vec3d& rotation, const cv::Vec3d& translation) {
  const Eigen::Vector3d r(rotation[0], rotation[1], rotation[2]);
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  if (r.norm() > 0) pose.linear() = Eigen::AngleAxisd(r.norm(), r.normalized()).toRotationMatrix();
  pose.translation() = Eigen::Vector3d(translation[0], translation[1], translation[2]);
  return pose;
}

Eigen::Isometry3d ippe_pose(const Lens& lens, const TagCorners& corners) {
  // IPPE for squares wants the y axis up: turn about x by half a turn, and back.
  const double h = 0.5 * lens.tag_size;
  const std::vector<cv::Point3d> square = {{-h, h, 0}, {h, h, 0}, {h, -h, 0}, {-h, -h, 0}};
  cv::Vec3d rotation, translation;
  cv::solvePnP(square, corners, lens.matrix, lens.distortion, rotation, translation, false,
               cv::SOLVEPNP_IPPE_SQUARE);
  const Eigen::Isometry3d pose = isometry(rotation, translation);
  return pose * Eigen::AngleAxisd(EIGEN_PI, Eigen::Vector3d::UnitX());
}

RestCorners::RestCorners(const Lens& lens) : lens_(lens), sums_(lens.tags), counts_(lens.tags, 0) {}

void RestCorners::add(const std::vector<TagCorners>& found) {
  poses_.clear();
  for (std::size_t t = 0; t < found.size(); ++t) {
    if (found[t].empty()) continue;
    ++counts_[t];
    for (std::size_t c = 0; c < 4; ++c) sums_[t][c] += found[t][c];
  }
}

void RestCorners::solve() const {
  if (!poses_.empty()) return;
  int learned_tags = 0;
  origin_.setZero();
  for (std::size_t t = 0; t < sums_.size(); ++t) {
    poses_.push_back(Eigen::Isometry3d::Identity());
    if (!learned(t)) continue;
    TagCorners mean;
    for (const cv::Point2d& sum : sums_[t]) mean.push_back(sum / counts_[t]);
    poses_.back() = ippe_pose(lens_, mean);
    origin_ += poses_.back().translation();
    ++learned_tags;
  }
  if (learned_tags > 0) origin_ /= learned_tags;
}

const Eigen::Isometry3d& RestCorners::camera_T_tag(std::size_t tag) const {
  solve();
  return poses_[tag];
}

const Eigen::Vector3d& RestCorners::origin() const {
  solve();
  return origin_;
}

Vector6 RestCorners::displacement(const Eigen::Isometry3d& motion) const {
  solve();
  const Eigen::AngleAxisd turn(motion.linear());
  Vector6 d;
  d << motion * origin_ - origin_, turn.angle() * turn.axis();
  return d;
}

}  // namespace tagwrench::bench
