// A force along a line, known as well as it is: a hung mass, a push through a load cell.
#pragma once

#include <Eigen/Core>
#include <string>

#include "host/wrench/fit.h"

namespace tagwrench {

struct LineLoad {
  double force = 0;           ///< N
  Eigen::Vector3d direction;  ///< unit, of the force on the platform, camera axes
  Eigen::Vector3d point;      ///< of application, platform frame, m

  double force_sigma = 0;      ///< relative, shared by all loads with the same force_name: the
                               ///< mass, the load cell's gain
  double direction_sigma = 0;  ///< rad, shared by the same direction_name: a mounting; a stroke
  double point_sigma = 0;      ///< m, shared by the same point_name
  std::string force_name, direction_name, point_name;

  double force_noise = 0;      ///< N, of this observation alone
  double direction_noise = 0;  ///< rad, of this observation alone
  double contact_sigma = 0;    ///< m, each way across the line; shared by one push, as its line
  std::string contact_name = {};
  double point_noise = 0;  ///< m, of this observation alone
};

/// Sets wrench, wrench_covariance, common and products: F = force * direction, M = point x F.
void set_line_load(const LineLoad& load, Observation& observation);

}  // namespace tagwrench
