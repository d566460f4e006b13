#include "host/calibration/print/sheets.h"

#include <cairo-pdf.h>
#include <cairo-svg.h>
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <cstddef>
#include <functional>
#include <memory>
#include <numbers>
#include <stdexcept>

#include "host/core/config_error.h"
#include "host/core/os/atomic_file.h"

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
constexpr double kScaleBar_mm = 50.0;
constexpr double kLetterWidth = 0.61;  // of a typewriter face, of its height

/// Where items may lie.
struct Rectangle {
  double left_mm = 0, top_mm = 0, right_mm = 0, bottom_mm = 0;
};

/// Something to cut out, and what is written under it.
struct Item {
  double size_x_mm = 0;  ///< of the printed black, without its white margin
  double size_y_mm = 0;
  double margin_mm = 0;  ///< white, to be cut out with it
  bool mark_up = false;  ///< a small triangle above says which way is up
  std::vector<std::string> labels;
};

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

/// Room for items on this paper.
Rectangle content(const Paper& paper) {
  return {kPaperMargin_mm + kSide_mm, kPaperMargin_mm + kHeader_mm,
          paper.width_mm - kPaperMargin_mm, paper.height_mm - kPaperMargin_mm - kFooter_mm};
}

/// The same sheet, lying.
Paper turned(const Paper& paper) { return {paper.name, paper.height_mm, paper.width_mm}; }

/// A page with title, notes and both scale bars.
Drawing start_page(const Paper& paper, const std::string& title,
                   const std::vector<std::string>& notes) {
  Drawing drawing{paper.width_mm, paper.height_mm, {}, {}, {}};
  const auto write = [&](double x, double y, double height, const std::string& text,
                         bool upward = false) {
    drawing.texts.push_back({{x, y}, height, TextAnchor::left, upward, text});
  };
  const double left = content(paper).left_mm, top = content(paper).top_mm;
  double y = kPaperMargin_mm + kTitle_mm;
  write(left, y, kTitle_mm, title);
  y += 0.3 * kTitle_mm;
  for (const std::string& note : notes) write(left, y += 1.25 * kNote_mm, kNote_mm, note);
  const double bottom = paper.height_mm - kPaperMargin_mm - 0.5 * kTick_mm;
  scale_bar(drawing, {left, bottom}, false);
  write(left + kScaleBar_mm + 3, bottom + 0.35 * kNote_mm, kNote_mm,
        "must measure 50.0 mm, like the standing bar");
  const double side = kPaperMargin_mm + 0.5 * kTick_mm;
  scale_bar(drawing, {side, top}, true);
  write(side + 0.5 * kTick_mm + kNote_mm, top + kScaleBar_mm, kNote_mm, "must measure 50.0 mm",
        true);
  return drawing;
}

/// The room that an item takes with cut marks and labels.
PagePoint extent(const Item& item) {
  const double marks = 2 * (item.margin_mm + kMarkGap_mm + kMark_mm);
  double width = item.size_x_mm + marks;
  for (const std::string& label : item.labels)
    width = std::max(width, kLetterWidth * kLabel_mm * label.size() + kGap_mm);
  const double height = item.size_y_mm + marks + 1.2 * kLabel_mm * item.labels.size();
  return {width + kGap_mm, height + kGap_mm};
}

/// Draws cut marks, labels and the triangle of an item whose room starts at `corner`. Returns the
/// top left corner of its black.
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

/// Directions clockwise from the right, y down.
constexpr std::array<int, 4> kStepX = {1, 0, -1, 0};
constexpr std::array<int, 4> kStepY = {0, 1, 0, -1};

const char* const kTrueSize = "Print at 100 %, never fitted to the page, never mirrored.";
constexpr double kMin_mm = 0.1;
constexpr double kMax_mm = 1000;

CellGrid tag_cells(TagFamily family, int id) {
  const TagPattern pattern = tag_pattern(family, id, 0, 0);
  CellGrid grid{pattern.cells, pattern.cells, {}};
  for (const std::uint8_t white : pattern.white) grid.black.push_back(white == 0);
  return grid;
}

void place_tag(Drawing& drawing, const Item& item, PagePoint room, TagFamily family, int id) {
  const CellGrid cells = tag_cells(family, id);
  const PagePoint corner = frame_item(drawing, item, room);
  drawing.areas.push_back(outline(cells, corner, item.size_x_mm / cells.columns));
}

/// How many items of this room fit, across and down.
std::array<int, 2> capacity(const Paper& paper, PagePoint room) {
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
  const int columns = capacity(paper, room)[0];
  for (int i = 0; i < count; ++i)
    place(i, {free.left_mm + (i % columns) * room.x_mm, free.top_mm + (i / columns) * room.y_mm});
}

// Throws unless so many copies of `each` items of this room fit.
void check_fit(const Paper& paper, PagePoint room, long each, int copies, const std::string& what) {
  if (copies < 1) throw ConfigError("--copies: {} is too few; use 1 or more", copies);
  const auto [columns, rows] = capacity(paper, room);
  if (columns < 1 || rows < 1) {
    throw ConfigError("{} does not fit on {}: {:.1f} x {:.1f} mm with its marks; make it smaller",
                      what, paper.name, room.x_mm, room.y_mm);
  }
  const long count = each * copies, places = static_cast<long>(columns) * rows;
  if (count > places) {
    throw ConfigError("--copies: {} times {} do not fit on {}, {} do; print fewer", count, what,
                      paper.name, places);
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
      std::ranges::move(outline(cells,
                                {corner.x_mm + column * square_mm + inset_mm,
                                 corner.y_mm + row * square_mm + inset_mm},
                                1e3 * board.marker / cells.columns),
                        std::back_inserter(area));
    }
  }
  std::ranges::move(outline(squares, corner, square_mm), std::back_inserter(area));
  return area;
}

constexpr double kPoint_mm = 25.4 / 72;  // PostScript's, which PDF and cairo count in

using Surface = std::unique_ptr<cairo_surface_t, decltype(&cairo_surface_destroy)>;
using Context = std::unique_ptr<cairo_t, decltype(&cairo_destroy)>;

cairo_status_t append(void* bytes, const unsigned char* data, unsigned int length) noexcept {
  try {
    static_cast<std::string*>(bytes)->append(reinterpret_cast<const char*>(data), length);
    return CAIRO_STATUS_SUCCESS;
  } catch (...) {
    return CAIRO_STATUS_NO_MEMORY;
  }
}

void fill(cairo_t* context, const Area& area) {
  for (const std::vector<PagePoint>& contour : area) {
    cairo_new_sub_path(context);
    for (const PagePoint& point : contour) cairo_line_to(context, point.x_mm, point.y_mm);
    cairo_close_path(context);
  }
  cairo_fill(context);
}

void stroke(cairo_t* context, const Line& line) {
  cairo_set_line_width(context, line.width_mm);
  cairo_move_to(context, line.from.x_mm, line.from.y_mm);
  cairo_line_to(context, line.to.x_mm, line.to.y_mm);
  cairo_stroke(context);
}

void write(cairo_t* context, const Text& text) {
  cairo_save(context);
  cairo_set_font_size(context, text.height_mm);
  cairo_translate(context, text.at.x_mm, text.at.y_mm);
  if (text.upward) cairo_rotate(context, -0.5 * std::numbers::pi);
  cairo_text_extents_t extents;
  cairo_text_extents(context, text.text.c_str(), &extents);
  cairo_move_to(context, text.anchor == TextAnchor::centre ? -0.5 * extents.x_advance : 0, 0);
  cairo_show_text(context, text.text.c_str());
  cairo_restore(context);
}

std::string render(const Drawing& drawing, bool pdf) {
  std::string bytes;
  const auto create =
      pdf ? &cairo_pdf_surface_create_for_stream : &cairo_svg_surface_create_for_stream;
  const Surface surface(
      create(&append, &bytes, drawing.width_mm / kPoint_mm, drawing.height_mm / kPoint_mm),
      &cairo_surface_destroy);
  // Without this a browser takes the numbers for pixels of 1/96 inch.
  if (!pdf) cairo_svg_surface_set_document_unit(surface.get(), CAIRO_SVG_UNIT_PT);
  const Context context(cairo_create(surface.get()), &cairo_destroy);
  cairo_scale(context.get(), 1 / kPoint_mm, 1 / kPoint_mm);
  cairo_set_source_rgb(context.get(), 0, 0, 0);
  cairo_set_fill_rule(context.get(), CAIRO_FILL_RULE_EVEN_ODD);
  cairo_select_font_face(context.get(), "monospace", CAIRO_FONT_SLANT_NORMAL,
                         CAIRO_FONT_WEIGHT_NORMAL);
  for (const Area& area : drawing.areas) fill(context.get(), area);
  for (const Line& line : drawing.lines) stroke(context.get(), line);
  for (const Text& text : drawing.texts) write(context.get(), text);
  cairo_show_page(context.get());
  cairo_surface_finish(surface.get());
  cairo_status_t status = cairo_status(context.get());
  if (status == CAIRO_STATUS_SUCCESS) status = cairo_surface_status(surface.get());
  if (status != CAIRO_STATUS_SUCCESS) {
    throw std::runtime_error(
        fmt::format("cairo cannot draw the sheet ({})", cairo_status_to_string(status)));
  }
  return bytes;
}

}  // namespace

Area outline(const CellGrid& grid, PagePoint corner, double cell_mm) {
  // Sides of black cells that face white, as steps between grid points with the black on their
  // right hand: per point and direction.
  std::vector<std::array<bool, 4>> leaves((grid.columns + 1) * (grid.rows + 1));
  const auto at = [&](int x, int y) -> std::array<bool, 4>& {
    return leaves[y * (grid.columns + 1) + x];
  };
  for (int row = 0; row < grid.rows; ++row) {
    for (int column = 0; column < grid.columns; ++column) {
      if (!grid.is_black(column, row)) continue;
      if (!grid.is_black(column, row - 1)) at(column, row)[0] = true;
      if (!grid.is_black(column + 1, row)) at(column + 1, row)[1] = true;
      if (!grid.is_black(column, row + 1)) at(column + 1, row + 1)[2] = true;
      if (!grid.is_black(column - 1, row)) at(column, row + 1)[3] = true;
    }
  }
  Area area;
  // Every contour has steps to the right; the first in reading order leaves one of its corners.
  for (int start_y = 0; start_y <= grid.rows; ++start_y) {
    for (int start_x = 0; start_x <= grid.columns; ++start_x) {
      while (at(start_x, start_y)[0]) {
        std::vector<PagePoint> contour;
        int x = start_x, y = start_y;
        std::size_t way = 0;
        bool turned = true;
        do {
          if (turned) contour.push_back({corner.x_mm + x * cell_mm, corner.y_mm + y * cell_mm});
          at(x, y)[way] = false;
          x += kStepX[way];
          y += kStepY[way];
          // Where two black cells touch by their corners the right turn keeps them apart.
          const std::size_t before = way;
          for (const std::size_t turn : {1, 0, 3}) {
            if (!at(x, y)[(before + turn) % 4]) continue;
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

double cell_mm(const TagSheet& sheet) { return sheet.size_mm / (bits_per_side(sheet.family) + 2); }

double cell_mm(const BoardSpec& board) {
  if (board.kind == BoardKind::checkerboard) return 1e3 * board.square;
  return 1e3 * board.marker / (bits_per_side(board.dictionary) + 2);
}

Drawing tag_sheet(const Paper& paper, const TagSheet& sheet) {
  const int ids = id_count(sheet.family);
  if (sheet.ids.empty()) throw ConfigError("--ids: is empty; list at least one tag id");
  for (const int id : sheet.ids)
    if (id < 0 || id >= ids)
      throw ConfigError("--ids: id {} is not in {}; use 0 to {}", id, name(sheet.family), ids - 1);
  if (!(sheet.size_mm >= kMin_mm && sheet.size_mm <= kMax_mm)) {
    throw ConfigError("--size-mm: {} is no size; use the edge of the black square in mm, {} to {}",
                      sheet.size_mm, kMin_mm, kMax_mm);
  }
  if (!(sheet.border_mm >= 0 && sheet.border_mm <= kMax_mm))
    throw ConfigError("--border-mm: {} is no border; use 0 mm or more", sheet.border_mm);
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
  check_fit(paper, room, each, sheet.copies, fmt::format("a tag of {} mm", sheet.size_mm));
  Drawing drawing = start_page(
      paper,
      fmt::format("{}  {} mm  border {} mm", name(sheet.family), sheet.size_mm, sheet.border_mm),
      {kTrueSize,
       fmt::format("The black square must measure {} mm. Cut along the marks; the triangle is up.",
                   sheet.size_mm)});
  fill(paper, room, each * sheet.copies, [&](int i, PagePoint corner) {
    const int id = sheet.ids[i % each];
    place_tag(drawing, item(id), corner, sheet.family, id);
  });
  return drawing;
}

Drawing board_sheet(const Paper& paper, const BoardSpec& board, int copies) {
  check(board);
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
    const auto [columns, rows] = capacity(sheet, room);
    return columns > 0 && rows > 0;
  };
  const Paper sheet = !fits(paper) && fits(turned(paper)) ? turned(paper) : paper;
  check_fit(sheet, room, 1, copies, "board " + spec);
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

void write_vector_file(const Drawing& drawing, const std::filesystem::path& path) {
  std::string ending = path.extension().string();
  for (char& c : ending) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  if (ending != ".pdf" && ending != ".svg")
    throw ConfigError("--out {}: is neither a .pdf nor an .svg; name it so", path.string());
  check_replaceable(path);
  write_atomically(path, render(drawing, ending == ".pdf"));
}

}  // namespace tagwrench
