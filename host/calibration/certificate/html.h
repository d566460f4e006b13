// A certificate as one page of HTML that needs nothing else, for screens and for A4.
#pragma once

#include <string>
#include <string_view>

#include "host/calibration/certificate/certificate.h"

namespace tagwrench {

/// How much room the figures and the remarks get, where a page would overflow.
struct PageRoom {
  double scatter_mm = 68, traces_mm = 98;  ///< height of the figures
  std::size_t warnings = 8;                ///< shown; the page says how many more the JSON has
  std::size_t warning_length = 300;        ///< characters
  std::size_t fact_length = 160;           ///< characters
};

/// `scatter` and `traces` are SVG of ours; everything else is escaped.
std::string certificate_html(const Certificate& certificate, const std::string& scatter,
                             const std::string& traces, const PageRoom& room);

/// `text` with what HTML would take for markup written as entities, and without control characters;
/// what is no UTF-8 becomes U+FFFD.
std::string escaped(std::string_view text);

}  // namespace tagwrench
