// Room calibration/certificate: an analysis -> one page, as HTML, PDF and JSON.
// In:  the figures of calibration/analysis, N and N m; facts about sensor, plan and program.
// Out: three files that bear the same number, a hash of the contents.
// Then: render.h, html.h, plots.h, files.h.
//
// What a certificate says: the figures of an analysis, and what they rest on.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "host/calibration/analysis/analysis.h"

namespace tagwrench {

/// Texts may hold anything: whoever writes them into a format escapes them.
struct Fact {
  std::string name, value;
};

struct CertificateData {
  std::string name;    ///< of the file, without folders
  std::string sha256;  ///< 64 hexadecimal digits
  std::uintmax_t bytes = 0;
};

struct Certificate {
  std::string number;    ///< of its contents; empty until they are complete
  std::string issued;    ///< YYYY-MM-DD
  std::string software;  ///< "tagwrench 0.1.0"
  std::vector<Fact> sensor;
  std::vector<Fact> procedure;
  std::vector<CertificateData> data;
  study::Analysis analysis;
};

/// The whole of it, SI units, one JSON object; its "analysis" is that of study::analysis_json().
std::string certificate_json(const Certificate& certificate);

// Numbers as people read them. The spaces in them do not break.

/// N or N m, with a prefix that leaves 1 to 999, three significant digits: "1.40 mN". What is not
/// finite is a dash.
std::string load_text(double value, int axis);

/// From low to high: "±0.45 N" where they are alike within 5 %, else "-0.450 to 0.900 N": three
/// significant digits of the larger, and as many decimals of the other.
std::string range_text(double low, double high, int axis);

/// Three significant digits, a dash for what is not finite.
std::string number_text(double value);

/// Two significant digits and a percent sign; "<0.01 %" for less, either way.
std::string percent_text(double value);

}  // namespace tagwrench
