#include "host/wrench/spring_model.h"

namespace tagwrench {
namespace {

Eigen::Matrix3d cross_matrix(const Eigen::Vector3d& v) {
  Eigen::Matrix3d m;
  m << 0, -v.z(), v.y(), v.z(), 0, -v.x(), -v.y(), v.x(), 0;
  return m;
}

}  // namespace

Matrix6 stiffness(const Springs& springs) {
  const Eigen::Matrix3d k =
      Eigen::Vector3d(springs.lateral, springs.lateral, springs.axial).asDiagonal();
  const Eigen::Matrix3d kappa =
      Eigen::Vector3d(springs.bending, springs.bending, springs.torsion).asDiagonal();
  Matrix6 sum = Matrix6::Zero();
  for (const Eigen::Vector3d& p : springs.centres) {
    // Point displacement: t + r x p = t - [p]x r. Its force f = k (t - [p]x r) has the moment p x f
    // about the origin.
    const Eigen::Matrix3d px = cross_matrix(p);
    sum.topLeftCorner<3, 3>() += k;
    sum.topRightCorner<3, 3>() -= k * px;
    sum.bottomLeftCorner<3, 3>() += px * k;
    sum.bottomRightCorner<3, 3>() += kappa - px * k * px;
  }
  return sum;
}

}  // namespace tagwrench
