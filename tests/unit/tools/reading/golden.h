// The reports of golden_reports.json, for the tests that run in C++.
#pragma once

#include <cstdint>
#include <fstream>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace tagwrench::test {

struct GoldenReport {
  std::string what;
  std::vector<std::uint8_t> bytes;
  nlohmann::json sample;
};

inline std::vector<GoldenReport> golden_reports() {
  std::vector<GoldenReport> reports;
  std::ifstream file(TAGWRENCH_GOLDEN_REPORTS);
  const nlohmann::json all = nlohmann::json::parse(file);
  for (const auto& entry : all.at("reports")) {
    GoldenReport report{entry.at("what"), {}, entry.at("sample")};
    for (const auto& field : entry.at("bytes")) {
      const std::string hex = field.at(1);
      for (std::size_t i = 0; i + 1 < hex.size(); i += 2) {
        report.bytes.push_back(static_cast<std::uint8_t>(std::stoi(hex.substr(i, 2), nullptr, 16)));
      }
    }
    reports.push_back(std::move(report));
  }
  return reports;
}

/// A good report with this sequence number.
inline std::vector<std::uint8_t> numbered_report(std::uint32_t sequence) {
  std::vector<std::uint8_t> bytes = golden_reports().front().bytes;
  for (std::size_t i = 0; i < 4; ++i) {
    bytes[57 + i] = static_cast<std::uint8_t>(sequence >> (8 * i));
  }
  return bytes;
}

}  // namespace tagwrench::test
