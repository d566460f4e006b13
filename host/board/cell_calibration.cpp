#include "host/board/cell_calibration.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "host/core/config_error.h"

namespace tagwrench::link {
namespace {

constexpr double kMinSpan = 20;  ///< standard deviations of the counts' difference: 5 % of scale
constexpr double kMinSigma_counts = 0.3;  ///< of a mean: counts are whole numbers (1/sqrt(12))

void check_span(const std::vector<CellPoint>& points) {
  const auto by_mass = [](const CellPoint& a, const CellPoint& b) { return a.mass_kg < b.mass_kg; };
  const auto [least, most] = std::minmax_element(points.begin(), points.end(), by_mass);
  if (points.size() < 2 || most->mass_kg - least->mass_kg < 1e-6) {
    throw ConfigError(
        "calibrate-cell: all masses are the same: give at least two different ones; for example "
        "--mass 0,0.5");
  }
  const double difference = std::abs(most->mean_counts - least->mean_counts);
  const double sigma = std::hypot(std::max(most->sigma_counts, kMinSigma_counts),
                                  std::max(least->sigma_counts, kMinSigma_counts));
  if (difference < kMinSpan * sigma) {
    throw ConfigError(fmt::format(
        "calibrate-cell: {:g} kg changed the counts by {:.0f} only, with an uncertainty of {:.0f}; "
        "take a larger mass, or check that it rests on this cell",
        most->mass_kg - least->mass_kg, difference, sigma));
  }
}

}  // namespace

Newtons CellCalibration::newtons(double counts) const noexcept {
  const double load = counts - zero_counts;
  const double random = std::hypot(noise_counts, zero_sigma_counts) * newtons_per_count;
  const double scale = load * newtons_per_count_sigma;
  const double variance =
      random * random + scale * scale - 2 * newtons_per_count * load * zero_scale_covariance_n;
  return {load * newtons_per_count, std::sqrt(std::max(variance, 0.0))};
}

CellCalibration fit_cell(const std::vector<CellPoint>& points, double gravity) {
  check_span(points);
  // counts = zero + slope * force, each point weighed by its variance.
  double w = 0, wx = 0, wxx = 0, wy = 0, wxy = 0;
  for (const CellPoint& point : points) {
    const double sigma = std::max(point.sigma_counts, kMinSigma_counts);
    const double weight = 1 / (sigma * sigma);
    const double force = point.mass_kg * gravity;
    w += weight;
    wx += weight * force;
    wxx += weight * force * force;
    wy += weight * point.mean_counts;
    wxy += weight * force * point.mean_counts;
  }
  const double determinant = w * wxx - wx * wx;
  const double slope = (w * wxy - wx * wy) / determinant;
  const double zero = (wxx * wy - wx * wxy) / determinant;
  double squares = 0;
  double weighted = 0;
  for (const CellPoint& point : points) {
    const double off = point.mean_counts - zero - slope * point.mass_kg * gravity;
    const double sigma = std::max(point.sigma_counts, kMinSigma_counts);
    squares += off * off;
    weighted += off * off / (sigma * sigma);
  }
  const double freedom = static_cast<double>(points.size()) - 2;
  const double scatter = freedom > 0 ? std::max(1.0, weighted / freedom) : 1.0;

  CellCalibration out;
  out.calibrated = true;
  out.newtons_per_count = 1 / slope;
  out.newtons_per_count_sigma = std::sqrt(scatter * w / determinant) / (slope * slope);
  out.zero_counts = zero;
  out.zero_sigma_counts = std::sqrt(scatter * wxx / determinant);
  out.zero_scale_covariance_n = scatter * wx / determinant / (slope * slope);
  if (freedom > 0) out.residual_n = std::sqrt(squares / freedom) / std::abs(slope);
  return out;
}

}  // namespace tagwrench::link
