// A light that is on or off, as a function of time, seen through exposures.
#pragma once

#include <cstddef>
#include <vector>

namespace tagwrench {

/// The part of a picture's exposure that a band of rows has: rows from the share `first` to the
/// share `last` of the picture's height (0 to 1, from the top).
struct RowBand {
  double first = 0;
  double last = 1;
};

/// When a camera exposes one picture. Row at the share f of the height: from
/// middle + (f - 1/2) readout - exposure/2 to middle + (f - 1/2) readout + exposure/2.
struct ExposureTimes {
  double middle = 0;    ///< of the exposure of the middle row, s
  double readout = 0;   ///< from the first row to the last, s; negative: from the last to the first
  double exposure = 0;  ///< of each row, s
};

/// Mean light that a band sees, 0 to 1, and its derivatives by the three times, 1/s.
struct SeenLight {
  double mean = 0;
  double by_middle = 0;
  double by_readout = 0;
  double by_exposure = 0;
};

class LightSignal {
 public:
  /// Off before the first edge, on after it, off after the second, and so on. Ascending, s.
  explicit LightSignal(std::vector<double> edges);

  SeenLight seen(const RowBand& band, const ExposureTimes& times) const noexcept;

  double first_edge() const noexcept { return edges_.front(); }
  double last_edge() const noexcept { return edges_.back(); }

 private:
  struct Integrals {
    double light, once, twice;  ///< signal less 1/2, its integral, and the integral of that
  };
  Integrals at(double time) const noexcept;

  std::size_t edges_until(double time) const noexcept;

  std::vector<double> edges_;
  std::vector<std::size_t> buckets_;  ///< number of the first edge in each of as many equal times
  double buckets_per_second_ = 0;
  std::vector<double> once_, twice_;  ///< at the edges
};

}  // namespace tagwrench
