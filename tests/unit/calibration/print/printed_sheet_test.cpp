// Sheets through their files: what OpenCV finds on the rasterised page, and how long it is there.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <map>
#include <opencv2/aruco.hpp>
#include <opencv2/aruco/charuco.hpp>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgproc.hpp>
#include <set>

#include "host/calibration/print/sheets.h"
#include "host/tracker/tag_dictionary.h"
#include "tests/unit/calibration/print/printed.h"

namespace tagwrench::test {
namespace {

constexpr int kDpi = 600;
constexpr double kTolerance_mm = 0.05;

struct SeenTag {
  int id = 0;
  std::array<cv::Point2d, 4> corners_mm;  // as printed, clockwise from the top left

  double side_mm(std::size_t i) const { return cv::norm(corners_mm[(i + 1) % 4] - corners_mm[i]); }
};

std::vector<SeenTag> detect(const cv::Mat& page, const cv::Ptr<cv::aruco::Dictionary>& family) {
  const auto parameters = cv::aruco::DetectorParameters::create();
  parameters->cornerRefinementMethod = cv::aruco::CORNER_REFINE_SUBPIX;
  std::vector<std::vector<cv::Point2f>> corners;
  std::vector<int> ids;
  cv::aruco::detectMarkers(page, family, corners, ids, parameters);
  std::vector<SeenTag> seen;
  for (std::size_t i = 0; i < ids.size(); ++i) {
    SeenTag tag;
    tag.id = ids[i];
    for (std::size_t c = 0; c < 4; ++c) tag.corners_mm[c] = on_page_mm(corners[i][c], kDpi);
    seen.push_back(tag);
  }
  return seen;
}

/// Length of the longest unbroken black run along a row.
double longest_run_mm(const cv::Mat& page) {
  int longest = 0;
  for (int row = 0; row < page.rows; ++row) {
    int run = 0;
    for (int column = 0; column < page.cols; ++column) {
      run = page.at<std::uint8_t>(row, column) < 128 ? run + 1 : 0;
      longest = std::max(longest, run);
    }
  }
  return longest * 25.4 / kDpi;
}

void expect_scale_bars(const cv::Mat& page) {
  EXPECT_NEAR(longest_run_mm(page), 50.0, kTolerance_mm) << "lying bar";
  EXPECT_NEAR(longest_run_mm(page.t()), 50.0, kTolerance_mm) << "standing bar";
}

/// Nothing is printed where common printers cannot.
void expect_white_margin(const cv::Mat& page) {
  const int margin = static_cast<int>(8 / 25.4 * kDpi);
  cv::Mat rim = page.clone();
  rim(cv::Rect(margin, margin, page.cols - 2 * margin, page.rows - 2 * margin)) = 255;
  double darkest = 0;
  cv::minMaxLoc(rim, &darkest);
  EXPECT_GT(darkest, 250);
}

void expect_two_rows_of_the_default_sheet(const cv::Mat& page) {
  const std::vector<SeenTag> seen = detect(page, tag_dictionary(TagFamily::aruco_original));
  std::map<int, std::vector<cv::Point2d>> at;
  for (const SeenTag& tag : seen) {
    at[tag.id].push_back(tag.corners_mm[0]);
    EXPECT_LT(tag.corners_mm[0].x, tag.corners_mm[1].x) << "upright";
    EXPECT_LT(tag.corners_mm[0].y, tag.corners_mm[3].y) << "upright";
    for (std::size_t side = 0; side < 4; ++side) {
      EXPECT_NEAR(tag.side_mm(side), 3.8, kTolerance_mm) << "id " << tag.id;
    }
    EXPECT_NEAR(cv::norm(tag.corners_mm[2] - tag.corners_mm[0]), 3.8 * std::sqrt(2.0),
                kTolerance_mm);
  }
  EXPECT_EQ(at.size(), 2u) << "ids 5 and 2 and no other";
  EXPECT_EQ(at[5].size(), 6u);
  EXPECT_EQ(at[2].size(), 6u);
  expect_scale_bars(page);
  expect_white_margin(page);
}

class PrintedPdf : public testing::Test {
 protected:
  void SetUp() override {
    if (!have("pdftoppm")) GTEST_SKIP() << "pdftoppm is not here; install poppler-utils";
  }
};

class PrintedSvg : public testing::Test {
 protected:
  void SetUp() override {
    if (!have("rsvg-convert")) GTEST_SKIP() << "rsvg-convert is not here; install librsvg2-bin";
  }
};

TEST_F(PrintedPdf, TagsAndScaleBarsMeasureRightAt600Dpi) {
  for (const Paper& paper : {kA4, kLetter}) {
    const cv::Mat page = print(tag_sheet(paper, {}), ".pdf", kDpi);
    ASSERT_FALSE(page.empty());
    EXPECT_NEAR(page.cols * 25.4 / kDpi, paper.width_mm, kTolerance_mm);
    EXPECT_NEAR(page.rows * 25.4 / kDpi, paper.height_mm, kTolerance_mm);
    expect_two_rows_of_the_default_sheet(page);
  }
}

TEST_F(PrintedSvg, TagsAndScaleBarsMeasureRightAt600Dpi) {
  const cv::Mat page = print(tag_sheet(kA4, {}), ".svg", kDpi);
  ASSERT_FALSE(page.empty());
  EXPECT_NEAR(page.cols * 25.4 / kDpi, kA4.width_mm, kTolerance_mm);
  EXPECT_NEAR(page.rows * 25.4 / kDpi, kA4.height_mm, kTolerance_mm);
  expect_two_rows_of_the_default_sheet(page);
}

TEST_F(PrintedPdf, TagsLieWhereTheLayoutPutsThem) {
  const Drawing drawing = tag_sheet(kA4, {});
  const cv::Mat page = print(drawing, ".pdf", kDpi);
  ASSERT_FALSE(page.empty());
  const std::vector<SeenTag> seen = detect(page, tag_dictionary(TagFamily::aruco_original));
  ASSERT_EQ(seen.size(), 12u);
  for (const SeenTag& tag : seen) {
    const cv::Point2d corner = tag.corners_mm[0];
    const bool there = std::any_of(drawing.areas.begin(), drawing.areas.end(), [&](const Area& a) {
      const PagePoint& first = a.front().front();
      return std::abs(first.x_mm - corner.x) < kTolerance_mm &&
             std::abs(first.y_mm - corner.y) < kTolerance_mm;
    });
    EXPECT_TRUE(there) << "id " << tag.id << " at " << corner;
  }
}

TEST_F(PrintedPdf, EveryKindOfFamilyIsReadWithItsIds) {
  for (const TagFamily family :
       {TagFamily::aruco_4x4_50, TagFamily::aruco_7x7_1000, TagFamily::apriltag_16h5,
        TagFamily::apriltag_36h11, TagFamily::grid_10x10}) {
    TagSheet sheet;
    sheet.family = family;
    sheet.ids = {0, 3, id_count(family) - 1};
    sheet.size_mm = 6.3;
    sheet.copies = 2;
    const cv::Mat page = print(tag_sheet(kLetter, sheet), ".pdf", kDpi);
    ASSERT_FALSE(page.empty());
    std::multiset<int> ids;
    for (const SeenTag& tag : detect(page, tag_dictionary(family))) {
      ids.insert(tag.id);
      for (std::size_t side = 0; side < 4; ++side) {
        EXPECT_NEAR(tag.side_mm(side), 6.3, kTolerance_mm) << name(family) << " id " << tag.id;
      }
    }
    const int last = id_count(family) - 1;
    EXPECT_EQ(ids, (std::multiset<int>{0, 0, 3, 3, last, last})) << name(family);
  }
}

TEST_F(PrintedSvg, NoSeamShowsBetweenBlackNeighbours) {
  TagSheet sheet;
  sheet.family = TagFamily::grid_10x10;
  sheet.ids = {0};
  sheet.copies = 1;
  const Drawing drawing = tag_sheet(kA4, sheet);
  const PagePoint corner = drawing.areas.back().front().front();
  const double cell = cell_mm(sheet);
  // Cells of a broken number of dots, which librsvg does not snap to the dots.
  for (const int dpi : {437, 600}) {
    const cv::Mat page = print(drawing, ".svg", dpi);
    ASSERT_FALSE(page.empty());
    // The black frame is one cell wide; along its middle the 12 cells follow on each other.
    for (int i = 0; i < static_cast<int>(11 * cell / 25.4 * dpi); ++i) {
      const double along = 0.5 * cell + i * 25.4 / dpi;
      const auto level = [&](double x_mm, double y_mm) {
        return static_cast<int>(
            page.at<std::uint8_t>(static_cast<int>((corner.y_mm + y_mm) / 25.4 * dpi),
                                  static_cast<int>((corner.x_mm + x_mm) / 25.4 * dpi)));
      };
      EXPECT_EQ(level(along, 0.5 * cell), 0) << dpi << " dpi, " << along << " mm";
      EXPECT_EQ(level(0.5 * cell, along), 0) << dpi << " dpi, " << along << " mm";
    }
  }
}

/// The part of the page around the drawing's last area, which is the board, and where it starts.
cv::Rect around_board(const Drawing& drawing, const cv::Mat& page) {
  double right = 0, bottom = 0, left = 1e9, top = 1e9;
  for (const std::vector<PagePoint>& contour : drawing.areas.back()) {
    for (const PagePoint& p : contour) {
      left = std::min(left, p.x_mm);
      right = std::max(right, p.x_mm);
      top = std::min(top, p.y_mm);
      bottom = std::max(bottom, p.y_mm);
    }
  }
  const auto dots = [](double mm) { return static_cast<int>(mm / 25.4 * kDpi); };
  const cv::Rect rect(dots(left) - 20, dots(top) - 20, dots(right - left) + 40,
                      dots(bottom - top) + 40);
  return rect & cv::Rect(0, 0, page.cols, page.rows);
}

/// OpenCV's corners of the printed board against OpenCV's own board.
void expect_charuco(const BoardSpec& spec, const std::string& ending) {
  const Drawing drawing = board_sheet(kA4, spec, 1);
  const cv::Mat page = print(drawing, ending, kDpi);
  ASSERT_FALSE(page.empty());
  const cv::Mat part = page(around_board(drawing, page));
  const auto board = cv::aruco::CharucoBoard::create(
      spec.columns, spec.rows, static_cast<float>(1e3 * spec.square),
      static_cast<float>(1e3 * spec.marker), tag_dictionary(spec.dictionary));
  const auto parameters = cv::aruco::DetectorParameters::create();
  parameters->perspectiveRemovePixelPerCell = 8;
  std::vector<std::vector<cv::Point2f>> corners;
  std::vector<int> ids;
  cv::aruco::detectMarkers(part, board->dictionary, corners, ids, parameters);
  EXPECT_EQ(ids.size(), static_cast<std::size_t>(markers(spec))) << describe(spec);
  ASSERT_FALSE(ids.empty());
  std::vector<cv::Point2f> inner;
  std::vector<int> inner_ids;
  cv::aruco::interpolateCornersCharuco(corners, ids, part, board, inner, inner_ids);
  const std::size_t all = static_cast<std::size_t>((spec.columns - 1) * (spec.rows - 1));
  ASSERT_EQ(inner.size(), all) << describe(spec);
  cv::Point2d offset(0, 0);
  std::vector<cv::Point2d> off;
  for (std::size_t i = 0; i < all; ++i) {
    const cv::Point3f& on_board = board->chessboardCorners[static_cast<std::size_t>(inner_ids[i])];
    off.push_back(on_page_mm(inner[i], kDpi) - cv::Point2d(on_board.x, on_board.y));
    offset += off.back() / static_cast<double>(all);
  }
  for (std::size_t i = 0; i < all; ++i) {
    EXPECT_LT(cv::norm(off[i] - offset), kTolerance_mm) << describe(spec) << " " << inner_ids[i];
  }
}

TEST_F(PrintedPdf, CharucoBoardIsOpenCvsForEveryParityOfRowsAndColumns) {
  for (const char* spec :
       {"charuco:9x6:5mm:3.7mm:aruco_4x4_50", "charuco:6x9:5mm:3.7mm:aruco_4x4_50",
        "charuco:7x5:5mm:3.7mm:aruco_5x5_100", "charuco:6x4:5mm:3.7mm:apriltag_36h11"}) {
    expect_charuco(parse_board(spec), ".pdf");
  }
}

TEST_F(PrintedPdf, TinyCharucoBoardForALensFocusedAt21MmIsFound) {
  expect_charuco(BoardSpec{}, ".pdf");
}

TEST_F(PrintedSvg, CharucoBoardIsOpenCvs) {
  expect_charuco(parse_board("charuco:9x6:5mm:3.7mm:aruco_4x4_50"), ".svg");
}

TEST_F(PrintedPdf, CheckerboardHasItsInnerCornersInPlace) {
  for (const char* text : {"checkerboard:9x6:1.2mm", "checkerboard:10x7:8mm"}) {
    const BoardSpec spec = parse_board(text);
    const Drawing drawing = board_sheet(kA4, spec, 1);
    const cv::Mat page = print(drawing, ".pdf", kDpi);
    ASSERT_FALSE(page.empty());
    const cv::Mat part = page(around_board(drawing, page));
    const cv::Size inner(spec.columns - 1, spec.rows - 1);
    std::vector<cv::Point2f> corners;
    ASSERT_TRUE(cv::findChessboardCorners(part, inner, corners)) << text;
    cv::cornerSubPix(part, corners, {5, 5}, {-1, -1}, {3, 50, 1e-3});
    // Turned by half if the detector began at the other end; the spacing is what counts.
    const double sign = corners.front().x < corners.back().x ? 1 : -1;
    for (int i = 0; i < inner.area(); ++i) {
      const cv::Point2d seen =
          on_page_mm(corners[static_cast<std::size_t>(i)], kDpi) - on_page_mm(corners[0], kDpi);
      const cv::Point2d made(sign * 1e3 * spec.square * (i % inner.width),
                             sign * 1e3 * spec.square * (i / inner.width));
      EXPECT_LT(cv::norm(seen - made), kTolerance_mm) << text << " corner " << i;
    }
  }
}

/// How many tags of each id there are of each size, in tenths of a millimetre.
std::map<int, std::map<int, int>> sizes_by_id(const cv::Mat& page) {
  std::map<int, std::map<int, int>> count;
  for (const SeenTag& tag : detect(page, tag_dictionary(TagFamily::aruco_original))) {
    double mean_mm = 0;
    for (std::size_t side = 0; side < 4; ++side) mean_mm += 0.25 * tag.side_mm(side);
    const int tenths = static_cast<int>(std::lround(10 * mean_mm));
    EXPECT_NEAR(mean_mm, 0.1 * tenths, kTolerance_mm) << "id " << tag.id;
    ++count[tag.id][tenths];
  }
  return count;
}

TEST_F(PrintedPdf, PublishedSheetHasTenIdsOfEverySize) {
  for (const Paper& paper : {kA4, kLetter}) {
    const cv::Mat page = print(published_sheet(paper), ".pdf", kDpi);
    ASSERT_FALSE(page.empty());
    const auto found = sizes_by_id(page);
    EXPECT_EQ(found.size(), 10u);
    for (const auto& [id, sizes] : found) {
      EXPECT_LT(id, 10);
      EXPECT_EQ(sizes.size(), 21u) << "id " << id << ": 3.0 to 5.0 mm";
      for (const auto& [tenths, count] : sizes) EXPECT_EQ(count, 1) << id << " " << tenths;
    }
    expect_scale_bars(page);
    expect_white_margin(page);
  }
}

TEST_F(PrintedPdf, PublishedSheetHoldsEveryTagOfTheOriginal) {
  const char* data = std::getenv("TAGWRENCH_DATA");
  if (data == nullptr) GTEST_SKIP() << "TAGWRENCH_DATA is not set";
  const cv::Mat original =
      rasterise(std::filesystem::path(data) / "icra2020" / "aruco_5x5_smaller.pdf", kDpi);
  if (original.empty()) GTEST_SKIP() << "TAGWRENCH_DATA holds no icra2020/aruco_5x5_smaller.pdf";
  const auto theirs = sizes_by_id(original);
  auto ours = sizes_by_id(print(published_sheet(kLetter), ".pdf", kDpi));
  ASSERT_FALSE(theirs.empty());
  for (const auto& [id, sizes] : theirs) {
    for (const auto& [tenths, count] : sizes) {
      EXPECT_EQ(ours[id].count(tenths), 1u) << "id " << id << ", " << tenths << " tenths of a mm";
    }
  }
}

}  // namespace
}  // namespace tagwrench::test
