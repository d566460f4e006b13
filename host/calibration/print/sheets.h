// Room calibration/print: tags and boards, true to scale.
// In:  families, ids and sizes, mm.
// Out: drawings in mm on A4 or letter, as PDF or SVG, with bars of 50.0 mm to measure.
// Then: board_spec.h (a board in one word), drawing.h, vector_file.h.
//
// What `tagwrench tags` prints: sheets of tags, calibration boards and the published sheet, as
// drawings.
#pragma once

#include <vector>

#include "host/calibration/print/board_spec.h"
#include "host/calibration/print/drawing.h"
#include "host/calibration/print/page.h"
#include "host/tracker/target.h"

namespace tagwrench {

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
