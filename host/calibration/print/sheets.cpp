#include "host/calibration/print/sheets.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <functional>

#include "host/core/config_error.h"
#include "host/tracker/tag_patterns.h"

namespace tagwrench {
namespace {

constexpr double kPaperMargin_mm = 10.0;  // what common printers leave white, and some more
constexpr double kTitle_mm = 3.5;
constexpr double kNote_mm = 2.5;
constexpr double kLabel_mm = 1.8;  // about 5 point
constexpr double kHeader_mm = 15.5;
constexpr double kFooter_mm = 8.0;  // the lying scale bar
constexpr double kSide_mm = 8.0;    // the standing scale bar
constexpr double kBar_mm = 0.6;     // thickness
constexpr double kTick_mm = 2.4;    // length of the bar's ends
constexpr double kTickInner_mm = 1.6;
constexpr double kTickLine_mm = 0.2;
constexpr int kTicks = 5;
constexpr double kMarkGap_mm = 0.5;  // from the cut to its mark
constexpr double kMark_mm = 1.2;
constexpr double kMarkLine_mm = 0.1;
constexpr double kGap_mm = 0.8;  // between rooms of neighbours
constexpr double kTriangle_mm = 1.0;

Area rectangle(double x0, double y0, double x1, double y1) {
  return {{{x0, y0}, {x1, y0}, {x1, y1}, {x0, y1}}};
}

// A bar of exactly 50 mm between the outer edges of its end ticks, along x; (x, y) is its middle
// line's left end. `standing` swaps the axes.
void scale_bar(Drawing& drawing, PagePoint start, bool standing) {
  const auto put = [&](double a0, double b0, double a1, double b1) {
    drawing.areas.push_back(
        standing ? rectangle(start.x_mm + b0, start.y_mm + a0, start.x_mm + b1, start.y_mm + a1)
                 : rectangle(start.x_mm + a0, start.y_mm + b0, start.x_mm + a1, start.y_mm + b1));
  };
  put(0, -0.5 * kBar_mm, kScaleBar_mm, 0.5 * kBar_mm);
  for (int i = 0; i <= kTicks; ++i) {
    const bool end = i == 0 || i == kTicks;
    const double half = 0.5 * (end ? kTick_mm : kTickInner_mm);
    // The end ticks lie within the length.
    const double at = std::clamp(i * kScaleBar_mm / kTicks - 0.5 * kTickLine_mm, 0.0,
                                 kScaleBar_mm - kTickLine_mm);
    put(at, -half, at + kTickLine_mm, half);
  }
}

}  // namespace

Rectangle content(const Paper& paper) {
  return {kPaperMargin_mm + kSide_mm, kPaperMargin_mm + kHeader_mm,
          paper.width_mm - kPaperMargin_mm, paper.height_mm - kPaperMargin_mm - kFooter_mm};
}

Paper turned(const Paper& paper) { return {paper.name, paper.height_mm, paper.width_mm}; }

Drawing start_page(const Paper& paper, const std::string& title,
                   const std::vector<std::string>& notes) {
  Drawing drawing;
  drawing.width_mm = paper.width_mm;
  drawing.height_mm = paper.height_mm;
  const double left = content(paper).left_mm;
  double y = kPaperMargin_mm + kTitle_mm;
  drawing.texts.push_back({{left, y}, kTitle_mm, TextAnchor::left, false, title});
  y += 0.3 * kTitle_mm;
  for (const std::string& note : notes) {
    y += 1.25 * kNote_mm;
    drawing.texts.push_back({{left, y}, kNote_mm, TextAnchor::left, false, note});
  }
  const double bottom = paper.height_mm - kPaperMargin_mm - 0.5 * kTick_mm;
  // Of named strings: GCC 12 takes moved temporaries of this length for an overrun
  // (-Warray-bounds).
  const std::string lying = "must measure 50.0 mm, like the standing bar";
  const std::string standing = "must measure 50.0 mm";
  scale_bar(drawing, {left, bottom}, false);
  drawing.texts.push_back({{left + kScaleBar_mm + 3, bottom + 0.35 * kNote_mm},
                           kNote_mm,
                           TextAnchor::left,
                           false,
                           lying});
  const double side = kPaperMargin_mm + 0.5 * kTick_mm;
  const double top = content(paper).top_mm;
  scale_bar(drawing, {side, top}, true);
  drawing.texts.push_back({{side + 0.5 * kTick_mm + kNote_mm, top + kScaleBar_mm},
                           kNote_mm,
                           TextAnchor::left,
                           true,
                           standing});
  return drawing;
}

namespace {

double text_width_mm(const std::string& text) {
  return kLetterWidth * kLabel_mm * static_cast<double>(text.size());
}

}  // namespace

PagePoint extent(const Item& item) {
  const double marks = 2 * (item.margin_mm + kMarkGap_mm + kMark_mm);
  double width = item.size_x_mm + marks;
  for (const std::string& label : item.labels)
    width = std::max(width, text_width_mm(label) + kGap_mm);
  const double height =
      item.size_y_mm + marks + 1.2 * kLabel_mm * static_cast<double>(item.labels.size());
  return {width + kGap_mm, height + kGap_mm};
}

PagePoint frame_item(Drawing& drawing, const Item& item, PagePoint corner) {
  const double half_x = 0.5 * item.size_x_mm + item.margin_mm;
  const double half_y = 0.5 * item.size_y_mm + item.margin_mm;
  const PagePoint centre = {corner.x_mm + 0.5 * extent(item).x_mm,
                            corner.y_mm + half_y + kMarkGap_mm + kMark_mm};
  for (const double x : {-1.0, 1.0}) {
    for (const double y : {-1.0, 1.0}) {
      const PagePoint cut = {centre.x_mm + x * half_x, centre.y_mm + y * half_y};
      const double near = kMarkGap_mm, far = kMarkGap_mm + kMark_mm;
      drawing.lines.push_back(
          {{cut.x_mm + x * near, cut.y_mm}, {cut.x_mm + x * far, cut.y_mm}, kMarkLine_mm});
      drawing.lines.push_back(
          {{cut.x_mm, cut.y_mm + y * near}, {cut.x_mm, cut.y_mm + y * far}, kMarkLine_mm});
    }
  }
  if (item.mark_up) {
    const double base = centre.y_mm - half_y - kMarkGap_mm;
    drawing.areas.push_back({{{centre.x_mm - 0.5 * kTriangle_mm, base},
                              {centre.x_mm, base - kTriangle_mm},
                              {centre.x_mm + 0.5 * kTriangle_mm, base}}});
  }
  double baseline = centre.y_mm + half_y + kMarkGap_mm + kMark_mm;
  for (const std::string& label : item.labels) {
    baseline += 1.2 * kLabel_mm;
    drawing.texts.push_back(
        {{centre.x_mm, baseline - 0.3 * kLabel_mm}, kLabel_mm, TextAnchor::centre, false, label});
  }
  return {centre.x_mm - 0.5 * item.size_x_mm, centre.y_mm - 0.5 * item.size_y_mm};
}

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
