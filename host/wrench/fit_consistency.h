// Steps that contradict the others: which few are wrong, or whether it is the fit's assumptions.
// Internal to the fit.
#pragma once

#include <string>
#include <vector>

#include "host/wrench/fit_errors.h"

namespace tagwrench::fit {

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
