// A drawing as a printer or a viewer would show it: through the file, Debian's renderers and back.
#pragma once

#include <filesystem>
#include <opencv2/core.hpp>
#include <string>

#include "host/calibration/print/sheets.h"

namespace tagwrench::test {

/// Whether a program of this name is on the PATH.
bool have(const std::string& program);

/// The file, a PDF of one page or an SVG, as 8-bit grey of `dpi` dots an inch, by poppler's
/// pdftoppm or librsvg's rsvg-convert. Empty if the renderer failed.
cv::Mat rasterise(const std::filesystem::path& file, int dpi);

/// Written as `ending` (".pdf", ".svg") and rasterised.
cv::Mat print(const Drawing& drawing, const std::string& ending, int dpi);

/// Where a pixel's centre lies on the page.
inline cv::Point2d on_page_mm(cv::Point2d pixel, int dpi) {
  return (pixel + cv::Point2d(0.5, 0.5)) * (25.4 / dpi);
}

}  // namespace tagwrench::test
