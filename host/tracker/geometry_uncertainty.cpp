#include <algorithm>
#include <numeric>

#include "host/core/algebra/decompositions.h"
#include "host/tracker/camera_model.h"
#include "host/tracker/photometric.h"
#include "host/tracker/rotation.h"

namespace tagwrench {
namespace {

constexpr double kTry = 0.2e-3;        // m, displacement for the numeric derivative
constexpr double kTryAngle = 0.01;     // rad
constexpr double kTagTry = 20e-6;      // m, of a tag
constexpr double kTagTryAngle = 2e-3;  // rad

/// Where the line of sight through `p` (camera frame) meets the plane through `origin` with
/// `normal`.
Eigen::Vector3d on_plane(const Eigen::Vector3d& p, const Eigen::Vector3d& origin,
                         const Eigen::Vector3d& normal) {
  return p * (normal.dot(origin) / normal.dot(p));
}

}  // namespace

void GeometryUncertainty::set(PhotometricAligner& aligner,
                              const Eigen::Isometry3d& camera_T_platform,
                              std::vector<Matrix6> tag_covariance, double scale_sigma) {
  scale_sigma_ = scale_sigma;
  const std::vector<PixelPatch>& patches = aligner.pixels().patches;
  const CameraModel& camera = aligner.pixels().camera;
  const auto tags = static_cast<double>(tag_covariance.size());
  std::vector<Eigen::Vector2d> shifts(patches.size());
  Vector6 unit;
  unit << Eigen::Vector3d::Constant(kTagTry), Eigen::Vector3d::Constant(kTagTryAngle);
  std::array<Matrix6, 6> none;
  none.fill(Matrix6::Zero());
  slopes_.assign(tag_covariance.size(), none);
  alone_.assign(tag_covariance.size(), slopes_);
  for (std::size_t t = 0; t < tag_covariance.size(); ++t) {
    // One plane for each tag, from a patch of it.
    Eigen::Vector3d centre = Eigen::Vector3d::Zero();
    Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();
    double count = 0;
    for (const PixelPatch& patch : patches) {
      if (patch.tag != t) continue;
      centre += camera_T_platform * patch.middle;
      normal = camera_T_platform.linear() *
               (patch.right - patch.middle).cross(patch.below - patch.middle);
      ++count;
    }
    if (count == 0) continue;
    centre /= count;
    const EigenSystem<6> eigen = symmetric_eigen(Matrix6(
        unit.cwiseInverse().asDiagonal() * tag_covariance[t] * unit.cwiseInverse().asDiagonal()));
    for (int k = 0; k < 6; ++k) {
      const Vector6 error = unit.cwiseProduct(eigen.vectors.col(k));
      const double size = std::sqrt(std::max(0.0, eigen.values[k]));
      const Eigen::Matrix3d turn = rotation_from_vector(error.tail<3>());
      Eigen::Vector3d origin = camera_T_platform.translation();
      origin += error.head<3>() / tags;
      for (int axis = 0; axis < 6; ++axis) {
        Vector6 displacement = Vector6::Zero();
        displacement[axis] = axis < 3 ? kTry : kTryAngle;
        const Eigen::Isometry3d displaced = moved(camera_T_platform, displacement);
        const Eigen::Matrix3d rotation = rotation_from_vector(displacement.tail<3>());
        for (std::size_t n = 0; n < patches.size(); ++n) {
          Eigen::Vector3d real = camera_T_platform * patches[n].middle;
          if (patches[n].tag == t) real = on_plane(real, centre + error.head<3>(), turn * normal);
          const Eigen::Vector3d now = origin + displacement.head<3>() + rotation * (real - origin);
          shifts[n] =
              project(camera, now).pixel - project(camera, displaced * patches[n].middle).pixel;
        }
        const double per = size / displacement[axis];
        const auto column = static_cast<std::size_t>(axis);
        slopes_[t][column].col(k) = per * aligner.motion_of(displaced, shifts);
        for (std::size_t seen = 0; seen < alone_.size(); ++seen)
          alone_[seen][t][column].col(k) = per * aligner.motion_of(displaced, shifts, seen);
      }
    }
  }
}

Matrix6 GeometryUncertainty::spread(const Slopes& slopes, const Vector6& displacement) noexcept {
  Matrix6 sum = Matrix6::Zero();
  for (const std::array<Matrix6, 6>& slope : slopes) {
    Matrix6 turned = Matrix6::Zero();
    for (int axis = 0; axis < 6; ++axis)
      turned += displacement[axis] * slope[static_cast<std::size_t>(axis)];
    sum += turned * turned.transpose();
  }
  return sum;
}

Matrix6 GeometryUncertainty::covariance(const Vector6& displacement) const noexcept {
  std::array<double, kMaxTags> all{};
  all.fill(1);
  return covariance(displacement, all);
}

Matrix6 GeometryUncertainty::covariance(
    const Vector6& displacement, const std::array<double, kMaxTags>& tag_share) const noexcept {
  Matrix6 sum = spread(slopes_, displacement);
  const auto end = tag_share.begin() + static_cast<std::ptrdiff_t>(alone_.size());
  const auto best = std::max_element(tag_share.begin(), end);
  if (alone_.size() > 1 && *best > 0) {
    const double others = std::accumulate(tag_share.begin(), end, 0.0) - *best;
    const double together = others / (*best * static_cast<double>(alone_.size() - 1));
    const Slopes& alone = alone_[static_cast<std::size_t>(best - tag_share.begin())];
    if (together < 1) sum = together * sum + (1 - together) * spread(alone, displacement);
  }
  // A target that is larger and farther by a part moves by as much more, and turns alike.
  const Eigen::Vector3d stretched = scale_sigma_ * displacement.head<3>();
  sum.topLeftCorner<3, 3>() += stretched * stretched.transpose();
  return sum;
}

}  // namespace tagwrench
