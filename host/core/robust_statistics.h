// What outliers hardly move.
#pragma once

#include <algorithm>
#include <vector>

namespace tagwrench {

/// A median absolute deviation, times this, is the standard deviation of normal errors:
/// 1 / Phi^-1(3/4).
inline constexpr double kMadToSigma = 1.4826;

/// Tukey's biweight, 0 from q = 1 on; cut at kTukey95 standard deviations it loses 5 % of the
/// efficiency of least squares for normal errors (Holland and Welsch 1977).
inline constexpr double kTukey95 = 4.685;
constexpr double biweight(double q) { return q * q < 1 ? (1 - q * q) * (1 - q * q) : 0; }

/// Huber's: errors beyond so many standard deviations pull with the same force; 95 % efficient for
/// normal errors (Huber 1964). It has one minimum, where the biweight may have several.
inline constexpr double kHuber95 = 1.345;

/// Of an even number the upper of the two in the middle; 0 of none.
inline double median(std::vector<double> values) {
  if (values.empty()) return 0;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

}  // namespace tagwrench
