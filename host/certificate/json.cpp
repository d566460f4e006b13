#include <nlohmann/json.hpp>

#include "host/certificate/certificate.h"
#include "host/study/analysis_report.h"

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
  out["analysis"] = ordered_json::parse(study::analysis_json(c.analysis, false));
  // Texts of files may hold anything; what is no UTF-8 is replaced.
  return out.dump(1, ' ', false, ordered_json::error_handler_t::replace) + "\n";
}

}  // namespace tagwrench
