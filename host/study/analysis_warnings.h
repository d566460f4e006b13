// What a person should be told about data that could be analyzed all the same.
#pragma once

#include <vector>

#include "host/study/analysis.h"
#include "host/study/cross_validation.h"

namespace tagwrench::study {

/// Adds to Analysis::warnings: lag, axes that were hardly loaded or only together, coarse steps of
/// the reference, channels filtered differently, clocks that run apart, a reference of the wrong
/// sign.
void add_warnings(const std::vector<CleanTrial>& trials, const std::vector<Range>& ranges,
                  const AnalysisOptions& options, Analysis& analysis);

}  // namespace tagwrench::study
