#include "host/tracker/square_pose.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <optional>

#include "host/tracker/projection.h"

namespace tagwrench {
namespace {

/// Corners of a square of edge 2, in the order of Square; tag axes are x right, y down.
constexpr double kSigns[4][2] = {{-1, -1}, {1, -1}, {1, 1}, {-1, 1}};

using Rays = Square;  ///< at z = 1

std::optional<Rays> rays_of(const CameraModel& camera, const Square& corners) {
  Rays rays;
  for (std::size_t c = 0; c < 4; ++c) {
    const auto ray = unproject(camera, corners[c]);
    if (!ray) return std::nullopt;
    rays[c] = ray->head<2>();
  }
  return rays;
}

/// The least-squares translation that goes with a rotation.
Eigen::Vector3d translation(const Rays& rays, const Eigen::Matrix3d& rotation, double half) {
  // Each corner gives two rows, (1 0 -x) and (0 1 -y); these are their normal equations.
  Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
  Eigen::Vector3d rhs = Eigen::Vector3d::Zero();
  for (int c = 0; c < 4; ++c) {
    const Eigen::Vector3d arm =
        half * (kSigns[c][0] * rotation.col(0) + kSigns[c][1] * rotation.col(1));
    const Eigen::Vector2d& ray = rays[static_cast<std::size_t>(c)];
    Eigen::Matrix<double, 2, 3> rows;
    rows << 1, 0, -ray.x(), 0, 1, -ray.y();
    normal += rows.transpose() * rows;
    rhs += rows.transpose() * (ray * arm.z() - arm.head<2>());
  }
  return normal.inverse() * rhs;
}

double squares_px(const CameraModel& camera, const Eigen::Isometry3d& pose, double half,
                  const Square& corners) {
  double sum = 0;
  for (std::size_t c = 0; c < 4; ++c) {
    const Eigen::Vector3d corner(half * kSigns[c][0], half * kSigns[c][1], 0);
    sum += (project(camera, pose * corner).pixel - corners[c]).squaredNorm();
  }
  return sum;
}

}  // namespace

/// In closed form (Heckbert, "Fundamentals of texture mapping and image warping", 1989, 2.2.3).
Eigen::Matrix3d square_homography(const Square& corners) {
  const auto cross = [](const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
    return a.x() * b.y() - a.y() * b.x();
  };
  const Eigen::Vector2d odd = corners[0] - corners[1] + corners[2] - corners[3];
  const Eigen::Vector2d right = corners[1] - corners[2];
  const Eigen::Vector2d bottom = corners[3] - corners[2];
  const double g = cross(odd, bottom) / cross(right, bottom);
  const double h = cross(right, odd) / cross(right, bottom);
  const Eigen::Vector2d along = corners[1] - corners[0] + g * corners[1];
  const Eigen::Vector2d down = corners[3] - corners[0] + h * corners[3];
  Eigen::Matrix3d from_corner;  // 0 to 1 to the right and down
  from_corner << along.x(), down.x(), corners[0].x(), along.y(), down.y(), corners[0].y(), g, h, 1;
  Eigen::Matrix3d corner_from_centre;
  corner_from_centre << 0.5, 0, 0.5, 0, 0.5, 0.5, 0, 0, 1;
  const Eigen::Matrix3d out = from_corner * corner_from_centre;
  return out / out(2, 2);
}

std::vector<Eigen::Isometry3d> square_poses(const CameraModel& camera, double size,
                                            const Square& corners) {
  const std::optional<Rays> rays = rays_of(camera, corners);
  if (!rays) return {};
  // The homography's derivative at the centre, and the rotation of the optical axis to there.
  const Eigen::Matrix3d h = square_homography(*rays);
  const Eigen::Vector2d centre = h.topRightCorner<2, 1>();
  const Eigen::Matrix2d derivative = h.topLeftCorner<2, 2>() - centre * h.bottomLeftCorner<1, 2>();
  if (!h.allFinite()) return {};
  const Eigen::Matrix3d turn =
      Eigen::Quaterniond::FromTwoVectors(Eigen::Vector3d::UnitZ(), centre.homogeneous())
          .toRotationMatrix();
  const Eigen::Matrix2d facing =
      (turn.topLeftCorner<2, 2>() - centre * turn.bottomLeftCorner<1, 2>()).inverse() * derivative;
  // Its larger singular value is the scale; what is left is the upper left of a rotation.
  const Eigen::Matrix2d gram = facing * facing.transpose();
  const double mean = 0.5 * gram.trace();
  const double scale = std::sqrt(mean + std::hypot(0.5 * (gram(0, 0) - gram(1, 1)), gram(0, 1)));
  const Eigen::Matrix2d upper = facing / scale;
  const double third = std::sqrt(std::max(0.0, 1 - upper.col(0).squaredNorm()));
  const double fourth = std::copysign(std::sqrt(std::max(0.0, 1 - upper.col(1).squaredNorm())),
                                      -upper.col(0).dot(upper.col(1)));

  const double half = 0.5 * size;
  std::vector<Eigen::Isometry3d> poses;
  for (const double sign : {1.0, -1.0}) {
    Eigen::Matrix3d rotation;
    rotation.col(0) << upper.col(0), sign * third;
    rotation.col(1) << upper.col(1), sign * fourth;
    rotation.col(2) = rotation.col(0).cross(rotation.col(1));
    Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
    pose.linear() = turn * rotation;
    pose.translation() = translation(*rays, pose.linear(), half);
    const bool faces_us = pose.linear().col(2).dot(pose.translation()) > 0;
    if (pose.matrix().allFinite() && pose.translation().z() > 0 && faces_us) poses.push_back(pose);
  }
  std::stable_sort(poses.begin(), poses.end(), [&](const auto& a, const auto& b) {
    return squares_px(camera, a, half, corners) < squares_px(camera, b, half, corners);
  });
  return poses;
}

}  // namespace tagwrench
