#include "host/calibration/print/sheets.h"

#include <gtest/gtest.h>

#include <cmath>

#include "host/core/config_error.h"

namespace tagwrench {
namespace {

template <typename Make>
std::string refusal(const Make& make) {
  try {
    make();
    return "";
  } catch (const ConfigError& error) {
    const std::string why = error.what();
    EXPECT_EQ(why.find('\n'), std::string::npos) << why;
    return why;
  }
}

std::string tags_refused(const TagSheet& sheet) {
  return refusal([&] { tag_sheet(kA4, sheet); });
}

bool contains(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

TEST(TagSheets, IdOutsideTheFamilyIsRefusedByName) {
  TagSheet sheet;
  sheet.ids = {5, 1024};
  EXPECT_TRUE(contains(tags_refused(sheet), "id 1024 is not in aruco_original"));
  sheet.ids = {-1};
  EXPECT_TRUE(contains(tags_refused(sheet), "id -1"));
  sheet.ids = {};
  EXPECT_TRUE(contains(tags_refused(sheet), "--ids"));
}

TEST(TagSheets, SizesThatAreNoneAreRefused) {
  for (const double size : {0.0, -3.8, std::nan(""), HUGE_VAL}) {
    TagSheet sheet;
    sheet.size_mm = size;
    EXPECT_TRUE(contains(tags_refused(sheet), "--size-mm")) << size;
    sheet.size_mm = 3.8;
    sheet.border_mm = size == 0 ? -0.1 : size;
    EXPECT_TRUE(contains(tags_refused(sheet), "--border-mm")) << size;
  }
}

TEST(TagSheets, WhatDoesNotFitThePageIsRefusedAndSaysHowManyDo) {
  TagSheet sheet;
  sheet.size_mm = 250;
  EXPECT_TRUE(contains(tags_refused(sheet), "does not fit on a4"));
  sheet.size_mm = 3.8;
  sheet.copies = 2'000'000'000;
  const std::string why = tags_refused(sheet);
  ASSERT_TRUE(contains(why, "--copies"));
  const int places = std::stoi(why.substr(why.find("a4, ") + 4));
  sheet.ids = {5};
  sheet.copies = places;
  EXPECT_EQ(tags_refused(sheet), "");
  sheet.copies = places + 1;
  EXPECT_TRUE(contains(tags_refused(sheet), "--copies"));
  sheet.copies = 0;
  EXPECT_TRUE(contains(tags_refused(sheet), "--copies"));
}

TEST(TagSheets, CellSizeCountsTheBlackFrame) {
  TagSheet sheet;
  EXPECT_NEAR(cell_mm(sheet), 3.8 / 7, 1e-12);
  sheet.family = TagFamily::grid_10x10;
  EXPECT_NEAR(cell_mm(sheet), 3.8 / 12, 1e-12);
}

TEST(BoardSheets, BoardLiesDownOnlyIfItMust) {
  EXPECT_LT(board_sheet(kA4, BoardSpec{}, 1).width_mm, 211);
  EXPECT_GT(board_sheet(kA4, parse_board("checkerboard:9x6:25mm"), 1).width_mm, 290);
}

TEST(BoardSheets, BoardLargerThanThePageIsRefused) {
  EXPECT_TRUE(contains(refusal([] { board_sheet(kA4, parse_board("checkerboard:9x6:40mm"), 1); }),
                       "does not fit"));
  EXPECT_TRUE(contains(refusal([] { board_sheet(kA4, BoardSpec{}, 1000); }), "--copies"));
  EXPECT_TRUE(contains(refusal([] { board_sheet(kA4, BoardSpec{}, 0); }), "--copies"));
}

TEST(BoardSheets, BoardThatCannotBeMadeIsRefused) {
  BoardSpec board;
  board.square = std::nan("");
  EXPECT_FALSE(refusal([&] { board_sheet(kA4, board, 1); }).empty());
}

}  // namespace
}  // namespace tagwrench
