// A certificate -> the texts of its three files.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "host/calibration/certificate/certificate.h"

namespace tagwrench {

struct RenderedCertificate {
  std::string html, pdf, json;
  int pages = 0;  ///< of the PDF; more than one only where even the smallest figures do not fit
};

/// Figures shrink and remarks are cut until the PDF is one page of A4. Throws ConfigError if
/// gnuplot or weasyprint is not installed, std::runtime_error if one fails.
RenderedCertificate render_certificate(const Certificate& certificate);

// Several files that belong together: all of them are written, or none.

struct NamedText {
  std::filesystem::path path;
  std::string_view text;
};

/// Writes temporaries beside all of them, then gives them their names. What had a name before is
/// replaced if `replace`, and stays as it was if any of the files cannot be written. Throws
/// std::runtime_error, also where a file is in the way and not to be replaced.
void write_together(const std::vector<NamedText>& files, bool replace);

}  // namespace tagwrench
