#include "host/calibration/print/cells.h"

#include <array>
#include <cstddef>

namespace tagwrench {
namespace {

/// Directions clockwise from the right, y down.
constexpr std::array<int, 4> kStepX = {1, 0, -1, 0};
constexpr std::array<int, 4> kStepY = {0, 1, 0, -1};

// Sides of black cells that face white, as steps between grid points with the black on their right
// hand.
class Sides {
 public:
  explicit Sides(const CellGrid& grid)
      : columns_(grid.columns + 1),
        rows_(grid.rows + 1),
        leaves_(static_cast<std::size_t>(columns_ * rows_)) {
    for (int row = 0; row < grid.rows; ++row) {
      for (int column = 0; column < grid.columns; ++column) {
        if (!grid.is_black(column, row)) continue;
        if (!grid.is_black(column, row - 1)) at(column, row)[0] = true;
        if (!grid.is_black(column + 1, row)) at(column + 1, row)[1] = true;
        if (!grid.is_black(column, row + 1)) at(column + 1, row + 1)[2] = true;
        if (!grid.is_black(column - 1, row)) at(column, row + 1)[3] = true;
      }
    }
  }

  std::array<bool, 4>& at(int x, int y) {
    return leaves_[static_cast<std::size_t>(y * columns_ + x)];
  }
  int columns() const { return columns_; }
  int rows() const { return rows_; }

 private:
  int columns_, rows_;
  std::vector<std::array<bool, 4>> leaves_;  // per grid point and direction
};

}  // namespace

Area outline(const CellGrid& grid, PagePoint corner, double cell_mm) {
  Sides sides(grid);
  Area area;
  // Every contour has steps to the right; the first in reading order leaves one of its corners.
  for (int start_y = 0; start_y < sides.rows(); ++start_y) {
    for (int start_x = 0; start_x < sides.columns(); ++start_x) {
      while (sides.at(start_x, start_y)[0]) {
        std::vector<PagePoint> contour;
        int x = start_x, y = start_y;
        std::size_t way = 0;
        bool turned = true;
        do {
          if (turned) contour.push_back({corner.x_mm + x * cell_mm, corner.y_mm + y * cell_mm});
          sides.at(x, y)[way] = false;
          x += kStepX[way];
          y += kStepY[way];
          // Where two black cells touch by their corners the right turn keeps them apart.
          const std::size_t before = way;
          for (const std::size_t turn : {1, 0, 3}) {
            if (!sides.at(x, y)[(before + turn) % 4]) continue;
            way = (before + turn) % 4;
            break;
          }
          turned = way != before;
        } while (x != start_x || y != start_y);
        area.push_back(std::move(contour));
      }
    }
  }
  return area;
}

}  // namespace tagwrench
