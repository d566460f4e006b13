#include "host/tracker/edges.h"

#include <algorithm>

namespace tagwrench {
namespace {

/// Points on one cell's side; about 3 to 5 px apart in the reference geometry, so that neighbours'
/// noise is independent.
constexpr int kPointsPerCell = 4;

/// Kept clear on both sides of a corner or crossing, in cells.
constexpr double kCornerMargin = 0.28;

/// The pattern with its white margin as a further ring of cells; true is white.
class Grid {
 public:
  explicit Grid(const TagPattern& pattern) : pattern_(pattern) {}
  int cells() const { return pattern_.cells; }
  bool white(int row, int column) const {
    if (row < 0 || column < 0 || row >= cells() || column >= cells()) return true;
    return pattern_.is_white(row, column);
  }

 private:
  const TagPattern& pattern_;
};

/// Looks at the grid in rows or in columns, so that one routine serves both directions of edges.
struct Walk {
  const Grid& grid;
  bool vertical_edges;  ///< edges between left and right neighbours

  /// `across` counts along the edge's normal, `along` along the edge.
  bool white(int across, int along) const {
    return vertical_edges ? grid.white(along, across) : grid.white(across, along);
  }

  /// The edge before cell `across`: does it go straight on past the vertex at the lower end of
  /// `along`?
  bool straight_at(int across, int along) const {
    return white(across - 1, along - 1) == white(across - 1, along) &&
           white(across, along - 1) == white(across, along);
  }

  /// Cells of equal colour from the edge before `across`, in the direction of `step`. Sides that
  /// run into the margin return -1.
  int run(int across, int along, int step) const {
    const int first = step > 0 ? across : across - 1;
    int count = 0;
    for (int i = first; i >= 0 && i < grid.cells(); i += step) {
      if (white(i, along) != white(first, along)) return count;
      ++count;
    }
    return count > 0 && !white(first, along) ? count : -1;
  }
};

double reach_of(const Walk& walk, int across, int along, double cell, double border) {
  double reach = 1e9;
  for (const int step : {-1, 1}) {
    const int run = walk.run(across, along, step);
    reach = std::min(reach, run < 0 ? border : run * cell);
  }
  return reach;
}

void add_points(const TagPattern& pattern, const Walk& walk, std::vector<EdgePoint>& points) {
  const int n = pattern.cells;
  const double cell = pattern.size / n;
  const double half = 0.5 * pattern.size;
  for (int across = 0; across <= n; ++across) {
    for (int along = 0; along < n; ++along) {
      const bool before = walk.white(across - 1, along);
      const bool after = walk.white(across, along);
      if (before == after) continue;
      const double low = walk.straight_at(across, along) ? 0.0 : kCornerMargin;
      const double high = walk.straight_at(across, along + 1) ? 1.0 : 1.0 - kCornerMargin;
      EdgePoint point;
      point.reach = reach_of(walk, across, along, cell, pattern.border);
      const double fixed = across * cell - half;
      for (int i = 0; i < kPointsPerCell; ++i) {
        const double moving =
            (along + low + (high - low) * (i + 0.5) / kPointsPerCell) * cell - half;
        if (walk.vertical_edges) {
          point.x = fixed;
          point.y = moving;
          point.normal = after ? EdgeNormal::plus_x : EdgeNormal::minus_x;
        } else {
          point.x = moving;
          point.y = fixed;
          point.normal = after ? EdgeNormal::plus_y : EdgeNormal::minus_y;
        }
        points.push_back(point);
      }
    }
  }
}

}  // namespace

EdgePoint shifted(EdgePoint point, double distance) {
  switch (point.normal) {
    case EdgeNormal::plus_x:
      point.x += distance;
      break;
    case EdgeNormal::minus_x:
      point.x -= distance;
      break;
    case EdgeNormal::plus_y:
      point.y += distance;
      break;
    case EdgeNormal::minus_y:
      point.y -= distance;
      break;
  }
  return point;
}

EdgeTag make_edge_tag(const TagPattern& pattern, const Eigen::Isometry3d& platform_T_tag) {
  EdgeTag tag;
  tag.id = pattern.id;
  tag.platform_T_tag = platform_T_tag;
  const Grid grid(pattern);
  add_points(pattern, Walk{grid, true}, tag.points);
  add_points(pattern, Walk{grid, false}, tag.points);
  const double cell = pattern.size / pattern.cells;
  for (int row = 0; row < pattern.cells; ++row) {
    for (int column = 0; column < pattern.cells; ++column) {
      CellPoint point;
      point.x = (column + 0.5) * cell - 0.5 * pattern.size;
      point.y = (row + 0.5) * cell - 0.5 * pattern.size;
      point.grey = pattern.is_white(row, column) ? 255.0F : 0.0F;
      tag.cells.push_back(point);
    }
  }
  return tag;
}

}  // namespace tagwrench
