// Light and sharpness: of a whole picture, whatever it shows, and of a tag in it, by the width of
// its ink edges, from pixels and cells alone: neither camera nor target need be calibrated.
#pragma once

#include <optional>

#include "host/core/types.h"
#include "host/tracker/acquire.h"

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

/// Sharper edges cannot be told from these.
constexpr double kLeastBlur_px = 0.2;

struct EdgeWidth {
  double blur_px = 0;            ///< of the lens: standard deviation of its Gaussian point spread,
                                 ///< before the pixels average over their own width
  double sharpening = 0;         ///< that the camera did: amount of its unsharp mask, 0 none
  double contrast = 0;           ///< grey levels from ink to paper, in the middle of the tag
  double white_fraction = 0;     ///< of the tag's pixels, at the sensor's upper end
  double residual_fraction = 0;  ///< RMS of what the fit leaves, over the contrast
  Square corners_px;             ///< of the black square, fitted
};

/// Fits the tag's cells, as a lens, pixels and an unsharp mask show them, to the image by least
/// squares over four corners, blur, the mask's amount a and radius r, and light (an offset, and a
/// gain with slopes):
///   level = (1 + a) G(s) * cells - a G(sqrt(s^2 + r^2)) * cells.
/// An edge out of place must not pass for a wide one, nor what a camera did to its picture for a
/// better lens: overshoot beside an edge tells of the mask, its slope of both. Pixels that are cut
/// off at either end of the grey scale tell only that the model is there too.
/// `corners_px` may be off by a third of a cell and may go round either way, as in a mirrored
/// image. Empty where the pixels do not look like this tag. Allocates; some 20 ms.
std::optional<EdgeWidth> edge_width(const ImageView& image, const TagPattern& pattern,
                                    const Square& corners_px);

}  // namespace tagwrench
