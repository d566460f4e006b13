// A Trial as a CSV file that people and spreadsheets can read, and back.
//
//   # tagwrench-data-1
//   # name: the trial's name
//   # held: true                     only where the reference is what hangs there
//   kind,t_s,step,x_m,...,rz_rad,sigma_x_m,...,predicted_Fx_N,...,predicted_sigma_Fx_N,...,
//        Fx_N,...,Mz_Nm,sigma_Fx_N,...,sigma_Mz_Nm
//   reading,0.04,0,1.2e-05,...       features; the reference's fields are empty
//   reference,0.05,,,...,0.21,...    the reverse
//
// Rows are in order of time. Columns of what is not known (step, sigmas, predictions) are left out
// as a whole; the predictions of one reading may be empty.
#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <string>
#include <vector>

namespace tagwrench::study {

// What an analysis works on: what a sensor read, and what a reference felt meanwhile.

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

/// Names of the six numbers of a displacement, with their units.
std::vector<std::string> displacement_names();

/// Throws std::invalid_argument if the shapes do not go together.
std::string trial_to_csv(const Trial& trial);

/// Throws ConfigError, naming file and line: no such file, numbers missing or not finite, times
/// that do not grow.
Trial read_trial(const std::filesystem::path& file);

/// Whether the file says of itself that it is one of ours.
bool is_trial_file(const std::filesystem::path& file);

}  // namespace tagwrench::study
