// What bands of rows see of a flashing light, in theory (LightSignal) and in pictures (RowProfiler:
// the pixels that the LED reaches and that stay within the sensor's range).
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "host/core/types.h"

namespace tagwrench {

// A light that is on or off, as a function of time, seen through exposures.

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

// Pictures of it.

/// Mean grey level of each band that has pixels, top to bottom.
using RowProfile = std::vector<double>;

/// Learns which pixels to use from pictures of one scene, lit and dark; then measures.
class RowProfiler {
 public:
  static constexpr int kMaxBands = 48;

  RowProfiler(int width, int height);

  void learn_lit(const ImageView& image) { learn(image, lit_); }
  void learn_dark(const ImageView& image) { learn(image, dark_); }

  /// To be called when both are learned. Empty, or one line that says why this scene tells nothing:
  /// no LED in it, white all over, too much light from elsewhere.
  std::string choose();

  const std::vector<RowBand>& bands() const noexcept { return bands_; }
  const RowProfile& lit() const noexcept { return lit_profile_; }
  const RowProfile& dark() const noexcept { return dark_profile_; }
  double used_fraction() const noexcept;       ///< of the pixels
  double saturated_fraction() const noexcept;  ///< of the pixels, when lit
  /// Light that is not the LED's, over all light, of the pixels in use, 0..1.
  double ambient_fraction() const noexcept { return ambient_part_; }

  RowProfile measure(const ImageView& image) const;

 private:
  struct Sum {
    std::vector<std::uint32_t> counts;  ///< per pixel
    std::uint32_t pictures = 0;
    double mean(std::size_t pixel) const { return counts[pixel] / static_cast<double>(pictures); }
  };
  void learn(const ImageView& image, Sum& sum) const;
  void make_bands();

  int width_, height_;
  Sum lit_, dark_;
  std::vector<std::uint8_t> used_;  ///< per pixel, 1 or 0
  std::vector<RowBand> bands_;
  std::vector<int> first_rows_, last_rows_;  ///< of the bands; the last exclusive
  RowProfile lit_profile_, dark_profile_;
  std::size_t used_count_ = 0, saturated_count_ = 0;
  double ambient_part_ = 0;
};

}  // namespace tagwrench
