// A load cell that stays on the sensor for good, and the line along which it acts.
#pragma once

#include <Eigen/Core>

namespace tagwrench {

struct ReferenceLine {
  int channel = 0;                                       ///< of the board
  Eigen::Vector3d point = Eigen::Vector3d::Zero();       ///< where it takes hold, platform frame, m
  Eigen::Vector3d direction = Eigen::Vector3d::UnitZ();  ///< of the force on the platform when the
                                                         ///< cell reads more than 0, camera axes
};

}  // namespace tagwrench
