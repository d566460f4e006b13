// What an analysis works on: what a sensor read, and what a reference felt meanwhile.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

namespace tagwrench::study {

/// Readings and reference have their own times on one clock (s); both grow. SI units.
struct Trial {
  std::string name;
  std::string file;               ///< it was read from, for messages; empty: none
  std::string sensor;             ///< which: the same text for the same one; empty: not known
  Eigen::VectorXd time;           ///< n, s
  Eigen::MatrixXd features;       ///< n x p: displacement (p = 6; m, rad), or whatever a CSV held
  Eigen::MatrixXd feature_sigma;  ///< n x p, one standard deviation; 0 x 0: not known
  std::vector<std::string> feature_names;  ///< p
  Eigen::VectorXd reference_time;          ///< m, s
  Eigen::MatrixXd reference;               ///< m x 6, N and N m: force before torque
  Eigen::MatrixXd reference_sigma;         ///< m x 6; 0 x 0: not known
  Eigen::VectorXi
      step;  ///< n: of a calibration plan, counted from 0, -1 between steps; empty: none
  Eigen::MatrixXd
      predicted;  ///< n x 6: what a calibration's own fit says of a reading whose step it
                  ///< has not seen, N and N m; NaN where it says nothing; 0 x 0: none
  Eigen::MatrixXd predicted_sigma;  ///< n x 6, of predicted - reference
  bool held = false;  ///< the reference is what hangs there, not an instrument: it has no lag
};

}  // namespace tagwrench::study
