// The crossing points of a checkered board in an image, to a few hundredths of a pixel.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <vector>

#include "host/core/types.h"

namespace tagwrench {

/// A crossing of two edges: of squares that are black and white by turns.
struct BoardCorner {
  Eigen::Vector2d board = Eigen::Vector2d::Zero();  ///< in squares, on the board
  Eigen::Vector2d pixel = Eigen::Vector2d::Zero();  ///< px
};

/// How the corners of one image look.
struct CornerView {
  double blur_px = 0;           ///< median standard deviation of the edges' spread
  double spacing_px = 0;        ///< median distance between neighbours
  double contrast = 0;          ///< median of white minus black, grey levels
  double clipped_fraction = 0;  ///< part of the corners whose white is at the top of the grey scale
};

struct RefinedCorners {
  std::vector<BoardCorner> corners;
  CornerView look;
};

/// What is printed in the white squares, in squares.
struct SquareFill {
  bool markers = false;  ///< in the white squares; and square (0, 0) is black
  double gap = 0;        ///< from the square's edge to the marker's
  double ring = 0;       ///< width of the marker's black border
};

/// Fits to the pixels around every corner
///   m + g . d + a (E(u) E(v) - 2 P(u - gap) P(v - gap) - 2 P(-u - gap) P(-v - gap))
/// with u, v the distances (px) from the two edges that cross there, E(u) = erf(u / (sqrt(2) s)),
/// P = (1 + E) / 2; the last two terms are the markers' nearest corners, where there are markers.
/// Blur, contrast and shading are fitted along, so they do not move the corner. A corner is left
/// out when it lies within its blur of the border, has no neighbours to tell the edges' directions,
/// stands off its neighbours' grid, or does not look like a crossing.
RefinedCorners refine_corners(const ImageView& image, const std::vector<BoardCorner>& rough,
                              const SquareFill& fill);

}  // namespace tagwrench
