#include "host/calibration/print/page.h"

#include <algorithm>

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

}  // namespace tagwrench
