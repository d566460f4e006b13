// An Analysis for people and for programs.
#pragma once

#include <string>

#include "host/calibration/analysis/analysis.h"

namespace tagwrench::study {

/// A page of text, lines of at most 100 characters but for warnings.
std::string analysis_text(const Analysis& analysis);

/// One JSON object, format "tagwrench-analysis-1": SI units, numbers that are not known null. The
/// held-out series is in it only if asked for.
std::string analysis_json(const Analysis& analysis, bool with_series);

}  // namespace tagwrench::study
