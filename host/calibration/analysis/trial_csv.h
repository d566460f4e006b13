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

#include <filesystem>
#include <string>

#include "host/calibration/analysis/trial.h"

namespace tagwrench::study {

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
