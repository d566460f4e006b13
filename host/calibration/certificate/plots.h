// The two figures of a certificate, drawn by gnuplot.
#pragma once

#include <string>

#include "host/calibration/analysis/analysis.h"

namespace tagwrench {

struct PlotSize {
  int width = 0, height = 0;  ///< px of CSS, 96 an inch
};

/// SVG, without an XML declaration. Reads: predicted against reference, one panel an axis. Throw
/// ConfigError if gnuplot is not installed, std::runtime_error if it fails.
std::string scatter_svg(const study::Analysis& analysis, PlotSize size);

/// The same over time: reference black, ours red.
std::string traces_svg(const study::Analysis& analysis, PlotSize size);

}  // namespace tagwrench
