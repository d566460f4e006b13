#include "host/tracker/corner_pose.h"

#include <limits>

#include "host/core/algebra/decompositions.h"
#include "host/tracker/projection.h"
#include "host/tracker/rotation.h"

namespace tagwrench {
namespace {

constexpr double kReachRotation = 0.6;  ///< rad
constexpr double kReachDistanceFraction =
    0.5;  ///< translation, as a part of the distance from the lens at rest
constexpr int kIterations = 12;
constexpr double kUnfit_px = 8.0;  ///< RMS beyond which corners and target do not belong together

struct CornerPair {
  Eigen::Vector3d p_platform;
  Eigen::Vector2d pixel;
};

struct CornerFit {
  Eigen::Isometry3d pose;
  double rms_px;
};

std::optional<CornerFit> fit_corners(const CameraModel& camera,
                                     const std::vector<CornerPair>& pairs, Eigen::Isometry3d pose) {
  double rms_px = 0;
  for (int i = 0; i <= kIterations; ++i) {
    Matrix6 normal = Matrix6::Zero();
    Vector6 right = Vector6::Zero();
    double squares = 0;
    for (const CornerPair& pair : pairs) {
      const Eigen::Vector3d arm = pose.linear() * pair.p_platform;
      const ProjectedPoint projected = project(camera, arm + pose.translation());
      if (!projected.valid) return std::nullopt;
      Eigen::Matrix<double, 2, 6> rows;
      rows << projected.jacobian, -projected.jacobian * cross_matrix(arm);
      const Eigen::Vector2d error = pair.pixel - projected.pixel;
      normal += rows.transpose() * rows;
      right += rows.transpose() * error;
      squares += error.squaredNorm();
    }
    rms_px = std::sqrt(squares / (2.0 * static_cast<double>(pairs.size())));
    if (i == kIterations) break;
    const Vector6 step = Ldlt<6>(normal).solve(right);
    if (!step.allFinite()) return std::nullopt;
    pose = moved(pose, step);
  }
  if (!pose.matrix().allFinite()) return std::nullopt;
  return CornerFit{pose, rms_px};
}

}  // namespace

bool within_reach(const Eigen::Isometry3d& rest_camera_T_platform,
                  const Eigen::Isometry3d& camera_T_platform) {
  const Vector6 motion = motion_between(rest_camera_T_platform, camera_T_platform);
  return motion.tail<3>().norm() < kReachRotation &&
         motion.head<3>().norm() <
             kReachDistanceFraction * rest_camera_T_platform.translation().norm();
}

std::optional<Eigen::Isometry3d> pose_from_corners(
    const CameraModel& camera, double tag_size, const std::vector<FoundTag>& found,
    const std::vector<Eigen::Isometry3d>& platform_T_tag,
    const Eigen::Isometry3d& rest_camera_T_platform) {
  const double h = 0.5 * tag_size;
  const Eigen::Vector3d corners[4] = {{-h, -h, 0}, {h, -h, 0}, {h, h, 0}, {-h, h, 0}};
  std::vector<CornerPair> pairs;
  std::vector<Eigen::Isometry3d> starts = {rest_camera_T_platform};
  for (const FoundTag& tag : found) {
    for (std::size_t c = 0; c < 4; ++c)
      pairs.push_back({platform_T_tag[tag.index] * corners[c], tag.corners_px[c]});
    for (const Eigen::Isometry3d& pose : tag.camera_T_tag)
      starts.push_back(pose * platform_T_tag[tag.index].inverse());
  }
  if (pairs.empty()) return std::nullopt;
  std::optional<Eigen::Isometry3d> best;
  double best_px = kUnfit_px;
  for (const Eigen::Isometry3d& start : starts) {
    const std::optional<CornerFit> fit = fit_corners(camera, pairs, start);
    if (!fit || fit->rms_px >= best_px || !within_reach(rest_camera_T_platform, fit->pose))
      continue;
    best = fit->pose;
    best_px = fit->rms_px;
  }
  return best;
}

}  // namespace tagwrench
