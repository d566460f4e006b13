// What a printed tag offers to measure: the boundaries between its black and white cells, and the
// cells themselves.
#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <vector>

namespace tagwrench {

/// A tag as printed.
struct TagPattern {
  int id = 0;
  int cells = 0;      ///< along one side of the black square, its black border included
  double size = 0;    ///< edge of the black square, m
  double border = 0;  ///< white margin around it, m
  std::vector<std::uint8_t>
      white;  ///< cells x cells, row by row from the top left: 1 white, 0 black

  bool is_white(int row, int column) const {
    return white[static_cast<std::size_t>(row * cells + column)] != 0;
  }
};

/// The direction along which an edge goes from black to white, in the tag's axes.
enum class EdgeNormal : std::uint8_t { plus_x, minus_x, plus_y, minus_y };

/// One place on a black-white boundary, in the tag's plane.
struct EdgePoint {
  double x = 0;  ///< m, tag axes, learned offset included
  double y = 0;
  EdgeNormal normal = EdgeNormal::plus_x;
  double reach =
      0;  ///< distance to the nearest other edge along the normal, m: no profile may be longer
  float contrast = 0;  ///< grey levels from black to white at rest; 0 when not learned
};

/// The point moved along its normal, toward white, m.
EdgePoint shifted(EdgePoint point, double distance);

/// The middle of one cell.
struct CellPoint {
  double x = 0;  ///< m, tag axes
  double y = 0;
  float grey = 0;  ///< level expected there, up to gain and offset
};

struct EdgeTag {
  int id = 0;
  Eigen::Isometry3d platform_T_tag = Eigen::Isometry3d::Identity();
  std::vector<EdgePoint> points;
  std::vector<CellPoint> cells;
};

/// One rigid body made of tags.
struct EdgeTarget {
  std::vector<EdgeTag> tags;
  double residual_px = 0;  ///< RMS of the fit at rest; 0 when not learned
};

/// Points along every boundary of the pattern, away from the places where boundaries meet: blur
/// rounds these off.
EdgeTag make_edge_tag(const TagPattern& pattern, const Eigen::Isometry3d& platform_T_tag);

}  // namespace tagwrench
