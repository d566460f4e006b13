// What outliers hardly move.
#pragma once

#include <algorithm>
#include <vector>

namespace tagwrench {

/// A median absolute deviation, times this, is the standard deviation of normal errors:
/// 1 / Phi^-1(3/4).
inline constexpr double kMadToSigma = 1.4826;

/// Of an even number the upper of the two in the middle; 0 of none.
inline double median(std::vector<double> values) {
  if (values.empty()) return 0;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

}  // namespace tagwrench
