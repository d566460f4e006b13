// Stiffness of the platform on its springs: newtons without a calibration.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "host/core/types.h"

namespace tagwrench {

/// Identical helical springs with parallel axes along platform z. A spring clamped at both ends
/// acts, for small displacements, as if it took hold of the platform at its elastic centre, which
/// by symmetry is its mid-length point: pure translation of that point gives pure force, pure
/// rotation about it gives pure torque (Wahl, Mechanical Springs, ch. 7 for the lateral stiffness
/// of compression springs).
struct Springs {
  std::vector<Eigen::Vector3d> centres;  ///< elastic centres, platform frame, m
  double axial = 700.0;                  ///< each spring, N/m
  double lateral = 70.0;                 ///< each spring, N/m
  double bending = 0.0;  ///< each spring, about x and y through its elastic centre, N m/rad
  double torsion = 0.0;  ///< each spring, about z, N m/rad
};

/// wrench = stiffness * displacement, about the platform origin at rest, camera axes; units N/m,
/// N/rad, N m/m, N m/rad.
Matrix6 stiffness(const Springs& springs);

}  // namespace tagwrench
