#include "tests/bench/table.h"

#include <fmt/format.h>

#include <cmath>
#include <cstdio>

namespace tagwrench::bench {
namespace {

constexpr const char* kAxis[6] = {"x", "y", "z", "rx", "ry", "rz"};

double shown(const Vector6& value, int axis) { return value[axis] * (axis < 3 ? 1e6 : 1e3); }

std::string figure(double value) {
  if (!std::isfinite(value)) return "-";
  return value < 10 ? fmt::format("{:.3f}", value) : fmt::format("{:.1f}", value);
}

}  // namespace

void Table::open(const std::string& name, const std::vector<std::string>& about) {
  case_ = name;
  fmt::print("\n=== {} ===\n", name);
  for (const std::string& text : about) fmt::print("{}\n", text);
  std::fflush(stdout);
}

void Table::columns(const std::string& what, const std::array<std::string, 6>& heads) {
  heads_ = heads;
  fmt::print("\n{:<44}", what);
  for (const std::string& head : heads) fmt::print("{:>10}", head);
  fmt::print("\n");
}

void Table::figures(const std::string& name, const std::array<double, 6>& value, int decimals) {
  fmt::print("  {:<42}", name);
  for (const double v : value)
    fmt::print("{:>10}", std::isfinite(v) ? fmt::format("{:.{}f}", v, decimals) : "-");
  fmt::print("\n");
  std::fflush(stdout);
}

void Table::at_least(const std::string& what, const std::array<double, 6>& value,
                     const std::array<double, 6>& limit, int decimals) {
  verdicts(what, value, limit, decimals, true);
}

void Table::at_most(const std::string& what, const std::array<double, 6>& value,
                    const std::array<double, 6>& limit, int decimals) {
  verdicts(what, value, limit, decimals, false);
}

void Table::verdicts(const std::string& what, const std::array<double, 6>& value,
                     const std::array<double, 6>& limit, int decimals, bool at_least) {
  const char* const relation = at_least ? "at least" : "at most";
  figures(std::string("target, ") + relation, limit, decimals);
  std::string missed;
  for (std::size_t i = 0; i < value.size(); ++i) {
    if (std::isnan(limit[i])) continue;
    ++targets_;
    if (at_least ? value[i] >= limit[i] : value[i] <= limit[i]) continue;  // NaN misses
    missed += (missed.empty() ? "" : " ") + heads_[i];
    misses_.push_back(fmt::format("{}: {}, {}: {:.{}f}, target {} {:.{}f}", case_, what, heads_[i],
                                  value[i], decimals, relation, limit[i], decimals));
  }
  fmt::print("  {:<42}{}\n", what, missed.empty() ? "ok" : "misses " + missed);
}

void Table::columns(const std::string& what) {
  fmt::print("\n{:<44}{:>9}{:>9}{:>9}{:>9}{:>9}{:>9}\n", what, "x um", "y um", "z um", "rx mrad",
             "ry mrad", "rz mrad");
}

void Table::row(const std::string& name, const Vector6& value) {
  fmt::print("  {:<42}", name);
  for (int a = 0; a < 6; ++a) fmt::print("{:>9}", figure(shown(value, a)));
  fmt::print("\n");
}

void Table::target(const std::string& what, const Vector6& value, const Vector6& limit) {
  row("target", limit);
  fmt::print("  {:<42}", what + " / target");
  std::string missed;
  for (int a = 0; a < 6; ++a) {
    const double ratio = value[a] / limit[a];
    if (!std::isfinite(limit[a])) {
      fmt::print("{:>9}", "-");
      continue;
    }
    fmt::print("{:>9}", ratio == ratio ? fmt::format("{:.2f}", ratio) : "-");
    ++targets_;
    if (ratio <= 1) continue;  // not a number misses
    missed += std::string(missed.empty() ? "" : " ") + kAxis[a];
    misses_.push_back(fmt::format("{}: {} {} {} of target {} ({:.2f} of it)", case_, what, kAxis[a],
                                  figure(shown(value, a)), figure(shown(limit, a)), ratio));
  }
  fmt::print("  {}\n", missed.empty() ? "ok" : "misses " + missed);
}

void Table::line(const std::string& text) {
  fmt::print("  {}\n", text);
  std::fflush(stdout);
}

void Table::verdict(const std::string& what, double value, double limit, bool ok,
                    const char* relation, const std::string& unit) {
  ++targets_;
  const std::string ratio = limit == 0 ? "" : fmt::format(" ({:.2f} of it)", value / limit);
  const std::string text = fmt::format("{}: {} {}, target at {} {}{}", what, figure(value), unit,
                                       relation, figure(limit), ratio);
  fmt::print("  {}  {}\n", text, ok ? "ok" : "misses");
  if (!ok) misses_.push_back(case_ + ": " + text);
}

void Table::at_most(const std::string& what, double value, double limit, const std::string& unit) {
  verdict(what, value, limit, value <= limit, "most", unit);
}

void Table::at_least(const std::string& what, double value, double limit, const std::string& unit) {
  verdict(what, value, limit, value >= limit, "least", unit);
}

void Table::skipped(const std::string& name, const std::string& reason) {
  fmt::print("\n=== {} ===\nskipped: {}\n", name, reason);
}

void Table::close() {
  fmt::print("\n=== targets ===\n{} of {} met", targets_ - static_cast<int>(misses_.size()),
             targets_);
  fmt::print("{}\n", misses_.empty() ? "" : "; these are missed:");
  for (const std::string& miss : misses_) fmt::print("  {}\n", miss);
}

}  // namespace tagwrench::bench
