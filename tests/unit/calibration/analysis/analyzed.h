// Trials of numbers for the tests of the analysis, and what it says of them.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>
#include <string>
#include <vector>

#include "host/calibration/analysis/analysis.h"
#include "host/core/config_error.h"
#include "tests/unit/calibration/analysis/loaded_platform.h"

namespace tagwrench::test {

inline bool warns(const study::Analysis& analysis, const std::string& part) {
  for (const std::string& warning : analysis.warnings) {
    if (warning.find(part) != std::string::npos) return true;
  }
  return false;
}

inline std::string all_warnings(const study::Analysis& analysis) {
  return std::accumulate(analysis.warnings.begin(), analysis.warnings.end(), std::string(),
                         [](const std::string& a, const std::string& b) { return a + "\n" + b; });
}

#define EXPECT_WARNS(analysis, part) EXPECT_TRUE(warns(analysis, part)) << all_warnings(analysis)

inline std::string complaint(const std::vector<study::Trial>& trials,
                             const study::AnalysisOptions& options = {}) {
  try {
    study::analyze(trials, options);
  } catch (const ConfigError& e) {
    return e.what();
  }
  return "no complaint";
}

/// The platform at rest for `pause` s, then loaded by one step of `load` for as long, and so on, a
/// reference without noise.
inline study::Trial steps(const Eigen::MatrixXd& loads, double pause, double rate = 50) {
  LoadedPlatform platform;
  platform.seconds = pause * static_cast<double>(loads.rows());
  platform.reading_rate = rate;
  platform.reference_rate = rate;
  platform.lag = 0;
  platform.amplitude.setZero();
  platform.reference_noise = 0;
  study::Trial trial = platform.trial();
  const Eigen::Matrix<double, 6, 6> compliance = true_stiffness().inverse();
  for (Eigen::Index i = 0; i < trial.time.size(); ++i) {
    const auto row = std::min(loads.rows() - 1,
                              static_cast<Eigen::Index>(static_cast<double>(i) / (pause * rate)));
    trial.reference.row(i) = loads.row(row);
    trial.features.row(i) += (compliance * loads.row(row).transpose()).transpose();
  }
  return trial;
}

/// Rest and full load of either sign on each axis in turn, over and over.
inline Eigen::MatrixXd loads_in_turn(int rounds) {
  const Eigen::Matrix<double, 6, 1> full{1, 1, 2, 0.02, 0.02, 0.015};
  Eigen::MatrixXd loads = Eigen::MatrixXd::Zero(24 * rounds, 6);
  for (int r = 0; r < rounds; ++r) {
    for (int k = 0; k < 6; ++k) {
      loads(24 * r + 4 * k + 1, k) = full[k];
      loads(24 * r + 4 * k + 3, k) = -full[k];
    }
  }
  return loads;
}

}  // namespace tagwrench::test
