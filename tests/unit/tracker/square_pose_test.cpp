#include <gtest/gtest.h>

#include <opencv2/calib3d.hpp>

#include "host/tracker/acquire.h"
#include "host/tracker/camera_model.h"
#include "host/tracker/rotation.h"

namespace tagwrench {
namespace {

constexpr double kSize = 3.8e-3;  // m

CameraModel lens() {
  CameraModel camera;
  camera.distortion = {-0.06, 0.02, 4e-4, -3e-4, 0.0};
  return camera;
}

Eigen::Isometry3d seen(const Eigen::Vector3d& position, const Eigen::Vector3d& rotation) {
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  pose.translation() = position;
  pose.linear() = rotation_from_vector(rotation);
  return pose;
}

Square corners_of(const CameraModel& camera, const Eigen::Isometry3d& pose) {
  constexpr double kSigns[4][2] = {{-1, -1}, {1, -1}, {1, 1}, {-1, 1}};
  Square corners;
  for (std::size_t c = 0; c < 4; ++c) {
    corners[c] = project(camera, pose * Eigen::Vector3d(0.5 * kSize * kSigns[c][0],
                                                        0.5 * kSize * kSigns[c][1], 0))
                     .pixel;
  }
  return corners;
}

/// What OpenCV makes of it, in its order, along our axes.
std::vector<Eigen::Isometry3d> opencv_poses(const CameraModel& camera, const Square& corners) {
  const double h = 0.5 * kSize;
  const std::vector<cv::Point3d> square = {{-h, h, 0}, {h, h, 0}, {h, -h, 0}, {-h, -h, 0}};
  std::vector<cv::Point2d> pixels;
  for (const Eigen::Vector2d& corner : corners) pixels.emplace_back(corner.x(), corner.y());
  const cv::Matx33d matrix(camera.fx_px, 0, camera.cx_px, 0, camera.fy_px, camera.cy_px, 0, 0, 1);
  const std::vector<double> distortion(camera.distortion.begin(), camera.distortion.end());
  std::vector<cv::Mat> rotations, translations;
  cv::solvePnPGeneric(square, pixels, matrix, distortion, rotations, translations, false,
                      cv::SOLVEPNP_IPPE_SQUARE);
  std::vector<Eigen::Isometry3d> out;
  for (std::size_t i = 0; i < rotations.size(); ++i) {
    const cv::Mat &r = rotations[i], &t = translations[i];
    Eigen::Isometry3d pose = seen({t.at<double>(0), t.at<double>(1), t.at<double>(2)},
                                  {r.at<double>(0), r.at<double>(1), r.at<double>(2)});
    pose.linear() = (pose.linear() * Eigen::Vector3d(1, -1, -1).asDiagonal()).eval();
    out.push_back(pose);
  }
  return out;
}

TEST(SquarePose, AgreesWithOpenCvOnCornersThatAreALittleOff) {
  const CameraModel camera = lens();
  for (int i = 0; i < 40; ++i) {
    const double a = 0.7 * i;
    const Eigen::Isometry3d pose =
        seen({2e-3 * std::sin(a), 2e-3 * std::cos(1.3 * a), 18e-3 + 1e-4 * i},
             {0.5 * std::sin(2.1 * a), 0.5 * std::cos(1.7 * a), 3 * std::sin(0.3 * a)});
    Square corners = corners_of(camera, pose);
    for (std::size_t c = 0; c < 4; ++c)
      corners[c] += 0.2 * Eigen::Vector2d(std::sin(5 * a + c), std::cos(3 * a + 2.0 * c));
    const std::vector<Eigen::Isometry3d> ours = square_poses(camera, kSize, corners);
    const std::vector<Eigen::Isometry3d> theirs = opencv_poses(camera, corners);
    ASSERT_EQ(ours.size(), 2U) << i;
    for (std::size_t p = 0; p < 2; ++p) {
      const Vector6 apart = motion_between(theirs[p], ours[p]);
      EXPECT_LT(apart.head<3>().norm(), 2e-6) << i;  // m; its undistortion ends after a few steps
      EXPECT_LT(apart.tail<3>().norm(), 1e-3) << i;  // rad
    }
  }
}

TEST(SquarePose, FindsThePoseThatMadeTheCorners) {
  const CameraModel camera = lens();
  const Eigen::Isometry3d pose = seen({1e-3, -2e-3, 21e-3}, {0.4, -0.3, 0.1});
  const std::vector<Eigen::Isometry3d> poses =
      square_poses(camera, kSize, corners_of(camera, pose));
  ASSERT_FALSE(poses.empty());
  EXPECT_LT((poses[0].matrix() - pose.matrix()).cwiseAbs().maxCoeff(), 1e-9);
}

TEST(SquarePose, HasNoneForCornersInALine) {
  const Square line = {{{100, 100}, {200, 100}, {300, 100}, {400, 100}}};
  EXPECT_TRUE(square_poses(lens(), kSize, line).empty());
}

TEST(SquarePose, HasNoneForATagSeenFromBehind) {
  Square corners = corners_of(lens(), seen({0, 0, 20e-3}, {0.3, 0.2, 0}));
  std::swap(corners[1], corners[3]);
  EXPECT_TRUE(square_poses(lens(), kSize, corners).empty());
}

}  // namespace
}  // namespace tagwrench
