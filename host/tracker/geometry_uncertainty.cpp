#include "host/tracker/geometry_uncertainty.h"

#include <cmath>

#include "host/core/algebra/decompositions.h"
#include "host/tracker/projection.h"
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
                              std::vector<Matrix6> tag_covariance, bool origin_follows) {
  tags_.clear();
  const std::vector<PixelPatch>& patches = aligner.pixels().patches;
  const CameraModel& camera = aligner.pixels().camera;
  const auto tags = static_cast<double>(tag_covariance.size());
  std::vector<Eigen::Vector2d> shifts(patches.size());
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
    TagPart part;
    for (Matrix6& slope : part.slope) slope.setZero();
    if (count > 0) {
      centre /= count;
      Vector6 unit;
      unit << Eigen::Vector3d::Constant(kTagTry), Eigen::Vector3d::Constant(kTagTryAngle);
      const Matrix6 scaled =
          unit.cwiseInverse().asDiagonal() * tag_covariance[t] * unit.cwiseInverse().asDiagonal();
      const EigenSystem<6> eigen = symmetric_eigen(scaled);
      for (int k = 0; k < 6; ++k) {
        const Vector6 error = unit.cwiseProduct(eigen.vectors.col(k));
        const double size = std::sqrt(std::max(0.0, eigen.values[k]));
        const Eigen::Matrix3d turn = rotation_from_vector(error.tail<3>());
        const Eigen::Vector3d origin_error =
            origin_follows ? Eigen::Vector3d(error.head<3>() / tags) : Eigen::Vector3d::Zero();
        for (int axis = 0; axis < 6; ++axis) {
          Vector6 displacement = Vector6::Zero();
          displacement[axis] = axis < 3 ? kTry : kTryAngle;
          const Eigen::Isometry3d displaced = moved(camera_T_platform, displacement);
          const Eigen::Vector3d origin = camera_T_platform.translation();
          for (std::size_t n = 0; n < patches.size(); ++n) {
            const Eigen::Vector3d described = camera_T_platform * patches[n].middle;
            const Eigen::Vector3d real =
                patches[n].tag == t ? on_plane(described, centre + error.head<3>(), turn * normal)
                                    : described;
            const Eigen::Matrix3d rotation = rotation_from_vector(displacement.tail<3>());
            const Eigen::Vector3d real_origin = origin + origin_error;
            const Eigen::Vector3d now =
                real_origin + displacement.head<3>() + rotation * (real - real_origin);
            shifts[n] =
                project(camera, now).pixel - project(camera, displaced * patches[n].middle).pixel;
          }
          part.slope[static_cast<std::size_t>(axis)].col(k) =
              size / displacement[axis] * aligner.motion_of(displaced, shifts);
        }
      }
    }
    tags_.push_back(part);
  }
}

Matrix6 GeometryUncertainty::covariance(const Vector6& displacement) const noexcept {
  Matrix6 sum = Matrix6::Zero();
  for (const TagPart& tag : tags_) {
    Matrix6 spread = Matrix6::Zero();
    for (int axis = 0; axis < 6; ++axis)
      spread += displacement[axis] * tag.slope[static_cast<std::size_t>(axis)];
    sum += spread * spread.transpose();
  }
  return sum;
}

}  // namespace tagwrench
