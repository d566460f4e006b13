// Light and sharpness of a whole picture, whatever it shows.
#pragma once

#include <optional>

#include "host/core/types.h"

namespace tagwrench {

struct PictureQuality {
  int dark_counts = 0;        ///< 1 % of the pixels are darker
  int bright_counts = 0;      ///< 1 % of the pixels are brighter
  double white_fraction = 0;  ///< of the pixels, at the sensor's upper end
  /// Standard deviation of the Gaussian blur of the sharper edges, px; good to a
  /// third, and never more than 12. Empty: there are no edges.
  std::optional<double> blur_px;
};

/// Allocates; about a millisecond for 640 x 480.
PictureQuality picture_quality(const ImageView& image);

}  // namespace tagwrench
