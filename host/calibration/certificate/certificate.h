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

}  // namespace tagwrench
