// Models richer than the linear one, and whether held-out data want them. Internal to the fit.
#pragma once

#include <span>
#include <vector>

#include "host/wrench/fit_errors.h"

namespace tagwrench::fit {

/// All that were tried against `linear`; at most one is adopted.
std::vector<ModelTrial> try_richer(const Problem& problem, const Judged& linear,
                                   std::span<const Observation> observations,
                                   std::span<const PathPoint> path);

}  // namespace tagwrench::fit
