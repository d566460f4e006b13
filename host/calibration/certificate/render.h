// A certificate -> the texts of its three files.
#pragma once

#include <string>

#include "host/calibration/certificate/certificate.h"

namespace tagwrench {

struct RenderedCertificate {
  std::string html, pdf, json;
  int pages = 0;  ///< of the PDF; more than one only where even the smallest figures do not fit
};

/// Figures shrink and remarks are cut until the PDF is one page of A4. Throws ConfigError if
/// gnuplot or weasyprint is not installed, std::runtime_error if one fails.
RenderedCertificate render_certificate(const Certificate& certificate);

}  // namespace tagwrench
