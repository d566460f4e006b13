// Pictures -> brightness of bands of rows, from the pixels that the LED reaches and that stay
// within the sensor's range.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "host/core/types.h"
#include "host/tools/camera_timing/light_signal.h"

namespace tagwrench {

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
