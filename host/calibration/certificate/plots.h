// The two figures of a certificate, drawn by gnuplot.
#pragma once

#include <chrono>
#include <string>
#include <string_view>
#include <vector>

#include "host/calibration/analysis/analysis.h"

namespace tagwrench {

// Another program as a function: text in, text out. No shell.

struct Program {
  std::string name;     ///< looked up in PATH
  std::string package;  ///< of Debian, for the message where it is missing
};

/// Its standard output, with `input` as its standard input. Throws ConfigError if it is not
/// installed; std::runtime_error, with the last line of its standard error, if it fails or does not
/// end in time (it is ended then).
std::string run_program(const Program& program, const std::vector<std::string>& arguments,
                        std::string_view input, std::chrono::seconds patience);

struct PlotSize {
  int width = 0, height = 0;  ///< px of CSS, 96 an inch
};

/// SVG, without an XML declaration. Reads: predicted against reference, one panel an axis. Throw
/// ConfigError if gnuplot is not installed, std::runtime_error if it fails.
std::string scatter_svg(const study::Analysis& analysis, PlotSize size);

/// The same over time: reference black, ours red.
std::string traces_svg(const study::Analysis& analysis, PlotSize size);

}  // namespace tagwrench
