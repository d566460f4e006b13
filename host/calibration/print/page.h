// The paper, what every sheet carries besides its items (title, notes, two scale bars), and the
// items' places on it.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "host/calibration/print/drawing.h"

namespace tagwrench {

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

}  // namespace tagwrench
