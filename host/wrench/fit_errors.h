// What a fit leaves unexplained: outlier steps, the model's own error, residuals that hang
// together. Internal to the fit.
#pragma once

#include <vector>

#include "host/wrench/fit_solve.h"

namespace tagwrench::fit {

/// A solution with weights, error model and rejections that agree with its hold-out residuals.
struct Judged {
  Solution solution;
  Weighting weighting;
  std::vector<std::vector<Prediction>> held_out;  ///< by block
  std::vector<double> chi2;        ///< of each block's held-out residual, per degree of freedom
  bool too_many_outliers = false;  ///< so many steps disagree that none was rejected
};

/// `left_out`: blocks that are not used whatever they say.
Judged judge(const Problem& problem, const std::vector<bool>& left_out);

/// Mean of e^T (V + error)^-1 e / 6 over each block.
std::vector<double> block_chi2(const Problem& problem,
                               const std::vector<std::vector<Prediction>>& held_out,
                               const ErrorModel& error);

/// A block that the others contradict, by more than what model errors are for.
bool is_outlier(const Problem& problem, const std::vector<Prediction>& held_out, double chi2);

}  // namespace tagwrench::fit
