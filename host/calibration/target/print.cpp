#include "host/calibration/target/print.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "host/core/robust_statistics.h"

namespace tagwrench {
namespace {

constexpr double kMinScatter = 0.5e-6;  // m
constexpr double kFirstScatter = 5e-6;  // m, before anything is known
constexpr double kCut = 4.0;            // sigmas, for an outlier
constexpr int kLags = 5;                // points along an edge over which errors may be alike

bool same_edge(const EdgePoint& a, const EdgePoint& b) {
  const bool vertical = a.normal == EdgeNormal::plus_x || a.normal == EdgeNormal::minus_x;
  return a.normal == b.normal && (vertical ? a.x == b.x : a.y == b.y);
}

}  // namespace

PrintScatter print_scatter(const std::vector<EdgeTag>& printed,
                           const std::vector<Eigen::Index>& first, const Eigen::VectorXd& shift,
                           const std::vector<double>& spread) {
  Eigen::VectorXd error = shift;
  for (std::size_t t = 0; t < printed.size(); ++t)
    error.segment(first[t], first[t + 1] - first[t]).array() -= spread[t];
  if (error.size() == 0 || error.isZero()) return {kFirstScatter, kFirstScatter};
  std::vector<double> sizes;
  for (const double e : error) sizes.push_back(std::abs(e));
  const auto middle = sizes.begin() + static_cast<std::ptrdiff_t>(sizes.size() / 2);
  std::nth_element(sizes.begin(), middle, sizes.end());
  PrintScatter out;
  out.robust = std::max(kMinScatter, kMadToSigma * *middle);
  error = error.cwiseMax(-kCut * out.robust).cwiseMin(kCut * out.robust);

  // The mean of n errors with autocorrelation r_l has the variance of n / (1 + 2 sum r_l)
  // independent ones.
  std::array<double, kLags + 1> sums{};
  std::array<double, kLags + 1> counts{};
  for (std::size_t t = 0; t < printed.size(); ++t) {
    const std::vector<EdgePoint>& points = printed[t].points;
    for (std::size_t i = 0; i < points.size(); ++i) {
      for (std::size_t lag = 0; lag <= kLags && i + lag < points.size(); ++lag) {
        if (!same_edge(points[i], points[i + lag])) break;
        const Eigen::Index at = first[t] + static_cast<Eigen::Index>(i);
        sums[lag] += error[at] * error[at + static_cast<Eigen::Index>(lag)];
        counts[lag] += 1;
      }
    }
  }
  double alike = 1;
  for (std::size_t lag = 1; lag <= kLags; ++lag) {
    if (counts[lag] > 0)
      alike += 2 * std::max(0.0, sums[lag] / counts[lag]) / (sums[0] / counts[0]);
  }
  out.effective = out.robust * std::sqrt(alike);
  return out;
}

}  // namespace tagwrench
