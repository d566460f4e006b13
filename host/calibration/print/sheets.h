// Room calibration/print: tags and boards, true to scale.
// In:  families, ids and sizes, mm.
// Out: drawings in mm on A4 or letter, as PDF or SVG, with bars of 50.0 mm to measure.
// Then: board_spec.h (a board in one word).
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "host/calibration/print/board_spec.h"
#include "host/tracker/target.h"

namespace tagwrench {

// A printed page as plain data. Millimetres from the top left corner of the paper, x right, y down.

struct PagePoint {
  double x_mm = 0, y_mm = 0;
};

/// Closed polygons filled black as one shape, even-odd: what lies inside two of them is white.
using Area = std::vector<std::vector<PagePoint>>;

struct Line {
  PagePoint from;
  PagePoint to;
  double width_mm = 0.1;
};

enum class TextAnchor : std::uint8_t { left, centre };

/// One line in a typewriter face.
struct Text {
  PagePoint at;          ///< on the baseline
  double height_mm = 2;  ///< of the type, from line to line
  TextAnchor anchor = TextAnchor::left;
  bool upward = false;  ///< runs from bottom to top
  std::string text;
};

struct Drawing {
  double width_mm = 0, height_mm = 0;
  std::vector<Area> areas;
  std::vector<Line> lines;
  std::vector<Text> texts;
};

/// Replaces the file as a whole, true to scale. The name's ending, .pdf or .svg, says which. Throws
/// ConfigError for another ending or a folder that takes no file, std::runtime_error if writing
/// fails later.
void write_vector_file(const Drawing& drawing, const std::filesystem::path& path);

struct Paper {
  std::string_view name;
  double width_mm = 0, height_mm = 0;
};

constexpr Paper kA4 = {"a4", 210.0, 297.0};
constexpr Paper kLetter = {"letter", 215.9, 279.4};

// Black cells of a grid -> the outline of their union, so that no viewer and no printer can leave
// a seam between neighbours.

struct CellGrid {
  int columns = 0, rows = 0;
  std::vector<bool> black;  ///< row by row from the top left

  bool is_black(int column, int row) const {
    return column >= 0 && row >= 0 && column < columns && row < rows &&
           black[row * columns + column];
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
