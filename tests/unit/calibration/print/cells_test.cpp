#include <gtest/gtest.h>

#include <random>

#include "host/calibration/print/sheets.h"

namespace tagwrench {
namespace {

CellGrid grid_of(int columns, const std::string& cells) {
  CellGrid grid{columns, static_cast<int>(cells.size()) / columns, {}};
  for (const char c : cells) grid.black.push_back(c == '#');
  return grid;
}

// Even-odd: a ray to the left crosses the outline an odd number of times.
bool inside(const Area& area, double x, double y) {
  bool in = false;
  for (const std::vector<PagePoint>& contour : area) {
    for (std::size_t i = 0; i < contour.size(); ++i) {
      const PagePoint& a = contour[i];
      const PagePoint& b = contour[(i + 1) % contour.size()];
      if ((a.y_mm > y) != (b.y_mm > y) && a.x_mm < x) in = !in;
    }
  }
  return in;
}

TEST(CellOutline, NeighboursShareOneContourWithoutPointsBetween) {
  const Area area = outline(grid_of(3, "###"), {10, 20}, 2);
  ASSERT_EQ(area.size(), 1u);
  ASSERT_EQ(area[0].size(), 4u);
  EXPECT_DOUBLE_EQ(area[0][0].x_mm, 10);
  EXPECT_DOUBLE_EQ(area[0][0].y_mm, 20);
  EXPECT_DOUBLE_EQ(area[0][2].x_mm, 16);
  EXPECT_DOUBLE_EQ(area[0][2].y_mm, 22);
}

TEST(CellOutline, RingHasAnInnerContour) {
  const Area area = outline(grid_of(3, "####.####"), {0, 0}, 1);
  ASSERT_EQ(area.size(), 2u);
  EXPECT_EQ(area[0].size(), 4u);
  EXPECT_EQ(area[1].size(), 4u);
}

TEST(CellOutline, CellsThatTouchByCornersStayApart) {
  EXPECT_EQ(outline(grid_of(2, "#..#"), {0, 0}, 1).size(), 2u);
  EXPECT_EQ(outline(grid_of(2, ".##."), {0, 0}, 1).size(), 2u);
}

TEST(CellOutline, NothingBlackHasNoContour) {
  EXPECT_TRUE(outline(grid_of(2, "...."), {0, 0}, 1).empty());
}

TEST(CellOutline, CoversTheBlackCellsAndNoOthers) {
  std::mt19937 random(4);
  for (int trial = 0; trial < 50; ++trial) {
    CellGrid grid{9, 7, {}};
    for (int i = 0; i < 63; ++i) grid.black.push_back(random() % 2 == 0);
    const Area area = outline(grid, {0, 0}, 1);
    for (int row = 0; row < 7; ++row) {
      for (int column = 0; column < 9; ++column) {
        EXPECT_EQ(inside(area, column + 0.5, row + 0.5), grid.is_black(column, row))
            << "trial " << trial << " row " << row << " column " << column;
      }
    }
  }
}

}  // namespace
}  // namespace tagwrench
