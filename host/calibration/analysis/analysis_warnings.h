// What a person should be told about data that could be analyzed all the same.
#pragma once

#include <string>
#include <vector>

#include "host/calibration/analysis/analysis.h"
#include "host/calibration/analysis/cross_validation.h"

namespace tagwrench::study {

/// Lines about axes without figures of their own, one for all axes of one reason. Where the trials
/// brought predictions, figures there are, and the line says what the data alone would not show.
std::vector<std::string> excitation_warnings(const Analysis& analysis);

/// Of intervals that hold far fewer errors than they say; empty if none.
std::vector<std::string> coverage_warnings(const Analysis& analysis);

/// Adds to Analysis::warnings: lag, axes that were hardly loaded or only together, coarse steps of
/// the reference, channels filtered differently, clocks that run apart, a reference of the wrong
/// sign.
void add_warnings(const std::vector<CleanTrial>& trials, const std::vector<Range>& ranges,
                  const AnalysisOptions& options, Analysis& analysis);

}  // namespace tagwrench::study
