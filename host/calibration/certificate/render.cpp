#include "host/calibration/certificate/render.h"

#include <array>
#include <cmath>
#include <stdexcept>

#include "host/calibration/certificate/html.h"
#include "host/calibration/certificate/plots.h"
#include "host/calibration/certificate/program.h"

namespace tagwrench {
namespace {

constexpr std::chrono::seconds kPatience{120};
constexpr double kPageWidth_mm = 186;
constexpr double kScatterShare = 0.62;  // of the page's width
constexpr double kPx_per_mm = 96 / 25.4;

constexpr std::array<PageRoom, 4> kRooms{{
    {68, 98, 8, 300, 160},
    {62, 84, 8, 300, 160},
    {54, 66, 6, 200, 100},
    {42, 42, 4, 110, 55},
}};

PlotSize plot_size(double width_mm, double height_mm) {
  return {static_cast<int>(std::lround(width_mm * kPx_per_mm)),
          static_cast<int>(std::lround(height_mm * kPx_per_mm))};
}

/// Objects of type Page; weasyprint leaves them uncompressed.
int pages_of(const std::string& pdf) {
  constexpr std::string_view kPage = "/Type /Page";
  int count = 0;
  for (std::size_t at = pdf.find(kPage); at != std::string::npos; at = pdf.find(kPage, at + 1)) {
    if (at + kPage.size() < pdf.size() && pdf[at + kPage.size()] != 's') ++count;
  }
  if (count == 0) throw std::runtime_error("weasyprint failed: its PDF has no page");
  return count;
}

}  // namespace

RenderedCertificate render_certificate(const Certificate& certificate) {
  RenderedCertificate result;
  result.json = certificate_json(certificate);
  for (const PageRoom& room : kRooms) {
    const std::string scatter = scatter_svg(
        certificate.analysis, plot_size(kScatterShare * kPageWidth_mm - 4, room.scatter_mm));
    const std::string traces =
        traces_svg(certificate.analysis, plot_size(kPageWidth_mm, room.traces_mm));
    result.html = certificate_html(certificate, scatter, traces, room);
    result.pdf =
        run_program({"weasyprint", "weasyprint"}, {"--quiet", "-", "-"}, result.html, kPatience);
    result.pages = pages_of(result.pdf);
    if (result.pages == 1) break;
  }
  return result;
}

}  // namespace tagwrench
