#include "host/tracker/corner_pose.h"

#include <limits>

#include "host/core/algebra/levenberg_marquardt.h"
#include "host/tracker/projection.h"
#include "host/tracker/rotation.h"

namespace tagwrench {
namespace {

constexpr double kReachRotation = 0.6;  ///< rad
constexpr double kReachDistanceFraction =
    0.5;                           ///< translation, as a part of the distance from the lens at rest
constexpr double kUnfit_px = 8.0;  ///< RMS beyond which corners and target do not belong together

struct CornerPair {
  Eigen::Vector3d p_platform;
  Eigen::Vector2d pixel;
};

/// Moves `pose` to the least squares near it; their RMS, px, infinite where a point is behind the
/// camera.
double fit_corners(const CameraModel& camera, const std::vector<CornerPair>& pairs,
                   Eigen::Isometry3d& pose) {
  const auto look = [&](const Eigen::Isometry3d& at) {
    FitSums<6> sums;
    for (const CornerPair& pair : pairs) {
      const Eigen::Vector3d arm = at.linear() * pair.p_platform;
      const ProjectedPoint projected = project(camera, arm + at.translation());
      if (!projected.valid) sums.squares = std::numeric_limits<double>::infinity();
      Eigen::Matrix<double, 2, 6> rows;
      rows << projected.jacobian, -projected.jacobian * cross_matrix(arm);
      const Eigen::Vector2d error = pair.pixel - projected.pixel;
      for (int i = 0; i < 2; ++i) sums.add(rows.row(i).transpose(), error[i]);
    }
    return sums;
  };
  const double squares = levenberg_marquardt(pose, look, moved).squares;
  return std::sqrt(squares / (2.0 * static_cast<double>(pairs.size())));
}

}  // namespace

bool within_reach(const Eigen::Isometry3d& reference, const Eigen::Isometry3d& camera_T_platform) {
  const Vector6 motion = motion_between(reference, camera_T_platform);
  return motion.tail<3>().norm() < kReachRotation &&
         motion.head<3>().norm() < kReachDistanceFraction * reference.translation().norm();
}

std::optional<Eigen::Isometry3d> pose_from_corners(
    const CameraModel& camera, double tag_size, const std::vector<FoundTag>& found,
    const std::vector<Eigen::Isometry3d>& platform_T_tag, const Eigen::Isometry3d& reference) {
  const double h = 0.5 * tag_size;
  const Eigen::Vector3d corners[4] = {{-h, -h, 0}, {h, -h, 0}, {h, h, 0}, {-h, h, 0}};
  std::vector<CornerPair> pairs;
  std::vector<Eigen::Isometry3d> starts = {reference};
  for (const FoundTag& tag : found) {
    for (std::size_t c = 0; c < 4; ++c)
      pairs.push_back({platform_T_tag[tag.index] * corners[c], tag.corners_px[c]});
    for (const Eigen::Isometry3d& pose : tag.camera_T_tag)
      starts.push_back(pose * platform_T_tag[tag.index].inverse());
  }
  if (pairs.empty()) return std::nullopt;
  std::optional<Eigen::Isometry3d> best;
  double best_px = kUnfit_px;
  for (Eigen::Isometry3d& pose : starts) {
    const double rms_px = fit_corners(camera, pairs, pose);
    if (!(rms_px < best_px) || !within_reach(reference, pose)) continue;
    best = pose;
    best_px = rms_px;
  }
  return best;
}

void set_corners(const CameraModel& camera, const TargetDescription& target,
                 const std::vector<Eigen::Isometry3d>& platform_T_tag,
                 const Eigen::Isometry3d& camera_T_platform, Track& track) noexcept {
  // Top left, top right, bottom right, bottom left: tag axes are x right, y down.
  constexpr double kSigns[4][2] = {{-1, -1}, {1, -1}, {1, 1}, {-1, 1}};
  track.corner_count = 0;
  if (platform_T_tag.size() != target.tags.size() || target.tags.size() > track.corners.size())
    return;
  const double half = 0.5 * target.tag_size;
  for (std::size_t t = 0; t < target.tags.size(); ++t) {
    TagCorners& out = track.corners[t];
    out.id = target.tags[t].id;
    for (std::size_t c = 0; c < 4; ++c) {
      const Eigen::Vector3d corner(kSigns[c][0] * half, kSigns[c][1] * half, 0);
      const ProjectedPoint at = project(camera, camera_T_platform * (platform_T_tag[t] * corner));
      if (!at.valid) return;
      const double x = at.pixel.x();
      out.px[2 * c] = camera.mirrored ? camera.width_px - 1 - x : x;
      out.px[2 * c + 1] = at.pixel.y();
    }
  }
  track.corner_count = static_cast<std::uint8_t>(target.tags.size());
}

}  // namespace tagwrench
