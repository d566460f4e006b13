// What a fit leaves unexplained: outlier steps, the model's own error, residuals that hang
// together; steps that contradict the others, which few are wrong, or whether it is the fit's
// assumptions. Internal to the fit.
#pragma once

#include <string>
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

/// e^T (V + model's error)^-1 e for an error in the place of the prediction.
double chi2_of(const Problem& problem, const Prediction& held_out, const ErrorModel& model,
               const Vector6& error);

/// What makes the steps agree with each other. The least far-fetched is taken, in about this order:
/// all is as stated; K is not symmetric; the model is off by 1 % of full load; a step is wrong; the
/// model is off by 3 %; more steps are wrong.
struct Explanation {
  bool found = false;          ///< else nothing of all that does; the rest says nothing then
  bool reciprocal = true;      ///< with K = K^T as the problem assumes it
  std::vector<bool> left_out;  ///< by block: of the steps that are wrong
};

/// Leaves out whole steps, at most a quarter of those with a load, and none if another one might
/// be it as well.
Explanation explain(const Problem& problem);

/// Gives up reciprocity where the data speak against it; refuses where they do so grossly, or where
/// steps are wrong besides, as little then tells which: throws ConfigError. `problem` and
/// `warnings` are told of it.
Judged judge_explained(Problem& problem, const Explanation& explanation,
                       std::vector<std::string>& warnings);

}  // namespace tagwrench::fit
