// Load cells in newtons: a straight line per channel from known masses.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

namespace tagwrench::link {

constexpr double kStandardGravity = 9.80665;  ///< m/s^2, by definition (CGPM 1901)

/// What the cell showed under one mass.
struct CellPoint {
  double mass_kg = 0;
  double mean_counts = 0;
  double sigma_counts = 0;  ///< of the mean
};

struct Newtons {
  double value = 0;
  double sigma = 0;  ///< one standard deviation: noise, zero and scale
};

struct CellCalibration {
  bool calibrated = false;
  double newtons_per_count = 0;
  double newtons_per_count_sigma = 0;
  double zero_counts = 0;
  double zero_sigma_counts = 0;
  double zero_scale_covariance_n = 0;  ///< of zero_counts and newtons_per_count: one line's both
  double noise_counts = 0;             ///< standard deviation of one conversion
  double residual_n = 0;               ///< rms of the points about the line; 0 of two points

  /// Only when calibrated.
  Newtons newtons(double counts) const noexcept;
};

constexpr std::size_t kMaxChannels = 4;
using CellCalibrations = std::array<CellCalibration, kMaxChannels>;

/// The line through two points, or nearest to more of them by least squares; zero is where no mass
/// weighs. Its uncertainty is that of the points, or what they scatter about the line if that is
/// more. Throws ConfigError if the masses do not span: fewer than two different ones, or counts
/// that differ by less than 20 of their standard deviations.
CellCalibration fit_cell(const std::vector<CellPoint>& points, double gravity = kStandardGravity);

}  // namespace tagwrench::link
