// Black cells of a grid -> the outline of their union, so that no viewer and no printer can leave
// a seam between neighbours.
#pragma once

#include <vector>

#include "host/calibration/print/drawing.h"

namespace tagwrench {

struct CellGrid {
  int columns = 0;
  int rows = 0;
  std::vector<bool> black;  ///< row by row from the top left

  bool is_black(int column, int row) const {
    return column >= 0 && row >= 0 && column < columns && row < rows &&
           black[static_cast<std::size_t>(row * columns + column)];
  }
};

/// Polygons around the black cells of a grid whose top left corner lies at `corner`.
Area outline(const CellGrid& grid, PagePoint corner, double cell_mm);

}  // namespace tagwrench
