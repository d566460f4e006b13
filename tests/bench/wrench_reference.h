// What a reference under the sensor would have recorded during a scenario.
#pragma once

#include <Eigen/Core>
#include <string>

#include "host/core/types.h"
#include "host/source/simulator/scenario.h"

namespace tagwrench::bench {

/// Readings at their own times, s of simulation time.
struct ReferenceRecord {
  std::string name;
  Eigen::VectorXd time;                              ///< m, s
  Eigen::MatrixXd wrench;                            ///< m x 6, N and N m, about `origin`
  Vector6 noise = Vector6::Zero();                   ///< RMS of what noise and rounding add, N, N m
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();  ///< platform frame at rest, m
};

/// The same load, its torque about `origin` (platform frame at rest, m).
Vector6 moved_to(const Eigen::Vector3d& origin, const Vector6& wrench);

/// The applied wrench itself about the platform origin at rest, 1,000 times a second.
ReferenceRecord ideal_reference(const sim::Scenario& scenario, double seconds);

/// After OptoForce's HEX-58-RE-400N as the paper used it: 100 Hz, a first-order filter of 15 Hz and
/// a transport delay that together make 40 ms, whole counts with 1 count of noise. It sits under
/// the sensor and feels torques about its own origin there.
ReferenceRecord optoforce_reference(const sim::Scenario& scenario, double seconds);

}  // namespace tagwrench::bench
