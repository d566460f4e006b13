// Room calibration/print: tags and boards, true to scale.
// In:  families, ids and sizes, mm.
// Out: drawings in mm on A4 or letter, as PDF or SVG, with bars of 50.0 mm to measure.
// Then: board_spec.h (a board in one word), drawing.h, vector_file.h.
//
// What `tagwrench tags` prints: sheets of tags, calibration boards and the published sheet, as
// drawings.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "host/calibration/print/board_spec.h"
#include "host/calibration/print/drawing.h"
#include "host/tracker/target.h"

namespace tagwrench {

// The paper, what every sheet carries besides its items (title, notes, two scale bars), and the
// items' places on it.

struct Paper {
  std::string_view name;
  double width_mm = 0;
  double height_mm = 0;
};

constexpr Paper kA4 = {"a4", 210.0, 297.0};
constexpr Paper kLetter = {"letter", 215.9, 279.4};

constexpr double kScaleBar_mm = 50.0;

/// Where items may lie.
struct Rectangle {
  double left_mm = 0;
  double top_mm = 0;
  double right_mm = 0;
  double bottom_mm = 0;
};

/// Room for items on this paper.
Rectangle content(const Paper& paper);

/// The same sheet, lying.
Paper turned(const Paper& paper);

/// A page with title, notes and both scale bars.
Drawing start_page(const Paper& paper, const std::string& title,
                   const std::vector<std::string>& notes);

/// Something to cut out, and what is written under it.
struct Item {
  double size_x_mm = 0;  ///< of the printed black, without its white margin
  double size_y_mm = 0;
  double margin_mm = 0;  ///< white, to be cut out with it
  bool mark_up = false;  ///< a small triangle above says which way is up
  std::vector<std::string> labels;
};

/// The room that an item takes with cut marks and labels.
PagePoint extent(const Item& item);

/// Draws cut marks, labels and the triangle of an item whose room starts at `corner`. Returns the
/// top left corner of its black.
PagePoint frame_item(Drawing& drawing, const Item& item, PagePoint corner);

// Black cells of a grid -> the outline of their union, so that no viewer and no printer can leave
// a seam between neighbours.

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

struct TagSheet {
  TagFamily family = TagFamily::aruco_original;
  std::vector<int> ids = {5, 2};
  double size_mm = 3.8;     ///< edge of the black square
  double border_mm = 0.35;  ///< white, cut out with the tag
  int copies = 6;           ///< of every id
};

/// Throws ConfigError for an id that is not in the family, a size that is none, more tags than the
/// page holds.
Drawing tag_sheet(const Paper& paper, const TagSheet& sheet);

/// Edge of a tag's cell, mm.
double cell_mm(const TagSheet& sheet);

/// The board lies on its side if only so it fits the paper. Throws ConfigError if it does not fit.
Drawing board_sheet(const Paper& paper, const BoardSpec& board, int copies);

/// The smallest thing to be printed of a board, mm: a marker's cell, or a square.
double cell_mm(const BoardSpec& board);

/// The sheet of the published design: ids 0 to 9 of aruco_original, 3.0 to 5.0 mm in steps of 0.1.
/// The sensor of the paper carries ids 5 and 2 of 3.8 mm.
Drawing published_sheet(const Paper& paper);

}  // namespace tagwrench
