#include <nlohmann/json.hpp>

#include "host/calibration/analysis/analysis.h"
#include "host/calibration/certificate/certificate.h"
#include "host/core/json/json_text.h"

namespace tagwrench {
namespace {

using nlohmann::ordered_json;

ordered_json facts_json(const std::vector<Fact>& facts) {
  ordered_json out = ordered_json::object();
  for (const Fact& fact : facts) out[fact.name] = fact.value;
  return out;
}

}  // namespace

std::string certificate_json(const Certificate& c) {
  ordered_json out{{"format", "tagwrench-certificate-1"},
                   {"number", c.number},
                   {"issued", c.issued},
                   {"software", c.software}};
  out["sensor"] = facts_json(c.sensor);
  out["calibration"] = facts_json(c.procedure);
  out["data"] = ordered_json::array();
  for (const CertificateData& d : c.data)
    out["data"].push_back({{"file", d.name}, {"sha256", d.sha256}, {"bytes", d.bytes}});
  out["analysis"] = parse_ordered_json(study::analysis_json(c.analysis, false));
  // Texts of files may hold anything; what is no UTF-8 is replaced.
  return dump_json(out, 1) + "\n";
}

}  // namespace tagwrench
