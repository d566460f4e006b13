// Rows of figures, each beside its target and with its ratio to it.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "host/core/types.h"

namespace tagwrench::bench {

class Table {
 public:
  /// A case begins: its name and what its frames are.
  void open(const std::string& name, const std::vector<std::string>& about);
  /// A block of six columns with these heads.
  void columns(const std::string& what, const std::array<std::string, 6>& heads);
  void figures(const std::string& name, const std::array<double, 6>& value, int decimals);
  /// Prints the limits, and says ok or what falls short of them; NaN has no limit.
  void at_least(const std::string& what, const std::array<double, 6>& value,
                const std::array<double, 6>& limit, int decimals);
  void at_most(const std::string& what, const std::array<double, 6>& value,
               const std::array<double, 6>& limit, int decimals);
  /// A block of six columns: x y z um, rx ry rz mrad.
  void columns(const std::string& what);
  void row(const std::string& name, const Vector6& value);  ///< m, rad
  /// Prints the target and the ratio of `value` to it, and says ok or what misses.
  void target(const std::string& what, const Vector6& value, const Vector6& limit);
  void line(const std::string& text);
  /// "what: value unit, target at least / at most limit: ok (ratio)".
  void at_most(const std::string& what, double value, double limit, const std::string& unit);
  void at_least(const std::string& what, double value, double limit, const std::string& unit);
  void skipped(const std::string& name, const std::string& reason);
  /// What was missed, over all cases.
  void close();

 private:
  void verdicts(const std::string& what, const std::array<double, 6>& value,
                const std::array<double, 6>& limit, int decimals, bool at_least);
  void verdict(const std::string& what, double value, double limit, bool ok, const char* relation,
               const std::string& unit);

  std::string case_;
  std::array<std::string, 6> heads_;
  int targets_ = 0;
  std::vector<std::string> misses_;
};

}  // namespace tagwrench::bench
