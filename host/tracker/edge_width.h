// How sharp a tag's picture is: the width of its ink edges, from pixels and cells alone. Neither
// camera nor target need be calibrated.
#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>

#include "host/core/types.h"
#include "host/tracker/edges.h"

namespace tagwrench {

using SquareCorners = std::array<Eigen::Vector2d, 4>;  ///< as printed: top left first, clockwise

struct EdgeWidth {
  double blur_px = 0;         ///< standard deviation of the Gaussian point spread before the pixels
                              ///< average over their own width
  double contrast = 0;        ///< grey levels from ink to paper, in the middle of the tag
  double white_fraction = 0;  ///< of the tag's pixels, at the sensor's upper end
  double residual_fraction = 0;  ///< RMS of what the fit leaves, over the contrast
  SquareCorners corners_px;      ///< of the black square, fitted
};

/// Below 0.7 px a pixel's own width hides much of it: good to a third there.
///
/// Fits the tag's cells, blurred, to its pixels by least squares over four corners, blur, and light
/// (an offset, and a gain with slopes): an edge out of place must not pass for a wide one.
/// `corners_px` may be off by a third of a cell and may go round either way, as in a mirrored
/// image. Empty where the pixels do not look like this tag. Allocates; some 20 ms.
std::optional<EdgeWidth> edge_width(const ImageView& image, const TagPattern& pattern,
                                    const SquareCorners& corners_px);

}  // namespace tagwrench
