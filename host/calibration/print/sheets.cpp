#include "host/calibration/print/sheets.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>

#include "host/calibration/print/cells.h"
#include "host/core/config_error.h"
#include "host/tracker/tag_patterns.h"

namespace tagwrench {
namespace {

const char* const kTrueSize = "Print at 100 %, never fitted to the page, never mirrored.";
constexpr double kMin_mm = 0.1;
constexpr double kMax_mm = 1000;

CellGrid tag_cells(TagFamily family, int id) {
  const TagPattern pattern = tag_pattern(family, id, 0, 0);
  CellGrid grid{pattern.cells, pattern.cells, {}};
  for (const std::uint8_t white : pattern.white) grid.black.push_back(white == 0);
  return grid;
}

void add(Area& area, const Area& more) { area.insert(area.end(), more.begin(), more.end()); }

void place_tag(Drawing& drawing, const Item& item, PagePoint room, TagFamily family, int id) {
  const CellGrid cells = tag_cells(family, id);
  const PagePoint corner = frame_item(drawing, item, room);
  drawing.areas.push_back(outline(cells, corner, item.size_x_mm / cells.columns));
}

struct Capacity {
  int columns = 0;
  int rows = 0;
};

Capacity capacity(const Paper& paper, PagePoint room) {
  const Rectangle free = content(paper);
  const auto count = [](double length, double each) {
    return static_cast<int>(std::floor(length / each + 1e-9));
  };
  return {count(free.right_mm - free.left_mm, room.x_mm),
          count(free.bottom_mm - free.top_mm, room.y_mm)};
}

// Calls `place` with the number and the room of each of `count` items, row by row.
void fill(const Paper& paper, PagePoint room, int count,
          const std::function<void(int, PagePoint)>& place) {
  const Rectangle free = content(paper);
  const int columns = capacity(paper, room).columns;
  for (int i = 0; i < count; ++i) {
    place(i, {free.left_mm + (i % columns) * room.x_mm, free.top_mm + (i / columns) * room.y_mm});
  }
}

void check_copies(int copies) {
  if (copies < 1) throw ConfigError(fmt::format("--copies: {} is too few; use 1 or more", copies));
}

// Throws unless `count` items of this room fit.
void check_fit(const Paper& paper, PagePoint room, long count, const std::string& what) {
  const Capacity most = capacity(paper, room);
  if (most.columns < 1 || most.rows < 1) {
    throw ConfigError(
        fmt::format("{} does not fit on {}: {:.1f} x {:.1f} mm with its marks; make it smaller",
                    what, paper.name, room.x_mm, room.y_mm));
  }
  const long places = static_cast<long>(most.columns) * most.rows;
  if (count > places) {
    throw ConfigError(fmt::format("--copies: {} times {} do not fit on {}, {} do; print fewer",
                                  count, what, paper.name, places));
  }
}

// The black of a board: its squares and its markers. Charuco as OpenCV 4.6 has it: black at the top
// left, ids in the white squares row by row.
Area board_area(const BoardSpec& board, PagePoint corner) {
  const bool charuco = board.kind == BoardKind::charuco;
  const double square_mm = 1e3 * board.square;
  const double inset_mm = 0.5e3 * (board.square - board.marker);
  CellGrid squares{board.columns, board.rows, {}};
  Area area;
  int id = 0;
  for (int row = 0; row < board.rows; ++row) {
    for (int column = 0; column < board.columns; ++column) {
      const bool black = (row + column) % 2 == 0;
      squares.black.push_back(black);
      if (black || !charuco) continue;
      const CellGrid cells = tag_cells(board.dictionary, id++);
      add(area, outline(cells,
                        {corner.x_mm + column * square_mm + inset_mm,
                         corner.y_mm + row * square_mm + inset_mm},
                        1e3 * board.marker / cells.columns));
    }
  }
  add(area, outline(squares, corner, square_mm));
  return area;
}

}  // namespace

double cell_mm(const TagSheet& sheet) { return sheet.size_mm / (bits_per_side(sheet.family) + 2); }

double cell_mm(const BoardSpec& board) {
  if (board.kind == BoardKind::checkerboard) return 1e3 * board.square;
  return 1e3 * board.marker / (bits_per_side(board.dictionary) + 2);
}

Drawing tag_sheet(const Paper& paper, const TagSheet& sheet) {
  const int ids = id_count(sheet.family);
  if (sheet.ids.empty()) throw ConfigError("--ids: is empty; list at least one tag id");
  for (const int id : sheet.ids) {
    if (id < 0 || id >= ids) {
      throw ConfigError(
          fmt::format("--ids: id {} is not in {}; use 0 to {}", id, name(sheet.family), ids - 1));
    }
  }
  if (!(sheet.size_mm >= kMin_mm && sheet.size_mm <= kMax_mm)) {
    throw ConfigError(
        fmt::format("--size-mm: {} is no size; use the edge of the black square in mm, {} to {}",
                    sheet.size_mm, kMin_mm, kMax_mm));
  }
  if (!(sheet.border_mm >= 0 && sheet.border_mm <= kMax_mm)) {
    throw ConfigError(
        fmt::format("--border-mm: {} is no border; use 0 mm or more", sheet.border_mm));
  }
  check_copies(sheet.copies);
  const auto item = [&sheet](int id) {
    return Item{sheet.size_mm,
                sheet.size_mm,
                sheet.border_mm,
                true,
                {std::string(name(sheet.family)), fmt::format("id {}  {} mm", id, sheet.size_mm)}};
  };
  // All get the room of the longest label.
  const PagePoint room = extent(item(*std::max_element(sheet.ids.begin(), sheet.ids.end())));
  const int each = static_cast<int>(sheet.ids.size());
  check_fit(paper, room, static_cast<long>(each) * sheet.copies,
            fmt::format("a tag of {} mm", sheet.size_mm));
  Drawing drawing = start_page(
      paper,
      fmt::format("{}  {} mm  border {} mm", name(sheet.family), sheet.size_mm, sheet.border_mm),
      {kTrueSize,
       fmt::format("The black square must measure {} mm. Cut along the marks; the triangle is up.",
                   sheet.size_mm)});
  fill(paper, room, each * sheet.copies, [&](int i, PagePoint corner) {
    const int id = sheet.ids[static_cast<std::size_t>(i % each)];
    Item one = item(id);
    place_tag(drawing, one, corner, sheet.family, id);
  });
  return drawing;
}

Drawing board_sheet(const Paper& paper, const BoardSpec& board, int copies) {
  check(board);
  check_copies(copies);
  const double square_mm = 1e3 * board.square;
  const std::string spec = describe(board);
  // The detectors want white around a board: a square if that is not large.
  const Item item = {board.columns * square_mm,
                     board.rows * square_mm,
                     std::clamp(square_mm, 1.0, 5.0),
                     false,
                     {spec}};
  const PagePoint room = extent(item);
  const auto fits = [&room](const Paper& sheet) {
    const Capacity most = capacity(sheet, room);
    return most.columns > 0 && most.rows > 0;
  };
  const Paper sheet = !fits(paper) && fits(turned(paper)) ? turned(paper) : paper;
  check_fit(sheet, room, copies, "board " + spec);
  Drawing drawing = start_page(
      sheet, "Board for the camera's calibration",
      {kTrueSize, "Keep it flat: glue it to glass or a metal plate. Cut along the marks.",
       "tagwrench calibrate camera --board " + spec});
  fill(sheet, room, copies, [&](int, PagePoint corner) {
    drawing.areas.push_back(board_area(board, frame_item(drawing, item, corner)));
  });
  return drawing;
}

Drawing published_sheet(const Paper& paper) {
  constexpr int kIds = 10;
  constexpr int kMaxTenths = 50, kMinTenths = 30, kSensorTenths = 38;
  constexpr double kBorder_mm = 0.35;
  constexpr double kRowLabel_mm = 16;
  constexpr double kRowType_mm = 2.5;
  Drawing drawing = start_page(
      paper, "aruco_original  ids 0 to 9  3.0 to 5.0 mm  border 0.35 mm",
      {kTrueSize, "The published sensor carries ids 5 and 2 of 3.8 mm (row with the arrow).",
       "R. Ouyang and R. Howe, Low-Cost Fiducial-based 6-Axis Force-Torque Sensor, ICRA 2020"});
  const Rectangle free = content(paper);
  double y = free.top_mm;
  for (int tenths = kMaxTenths; tenths >= kMinTenths; --tenths) {
    const double size_mm = 0.1 * tenths;
    PagePoint room;
    for (int id = 0; id < kIds; ++id) {
      const Item item = {size_mm, size_mm, kBorder_mm, false, {std::to_string(id)}};
      room = extent(item);
      place_tag(drawing, item, {free.left_mm + kRowLabel_mm + id * room.x_mm, y},
                TagFamily::aruco_original, id);
    }
    drawing.texts.push_back(
        {{free.left_mm, y + 0.5 * room.y_mm},
         kRowType_mm,
         TextAnchor::left,
         false,
         fmt::format("{:.1f} mm{}", size_mm, tenths == kSensorTenths ? " >" : "")});
    y += room.y_mm;
  }
  return drawing;
}

}  // namespace tagwrench
