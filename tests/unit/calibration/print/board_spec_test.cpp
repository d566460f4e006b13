#include "host/calibration/print/board_spec.h"

#include <gtest/gtest.h>

#include "host/core/config_error.h"

namespace tagwrench {
namespace {

// The message of the refusal, empty if the text is taken.
std::string refusal(std::string_view text) {
  try {
    parse_board(text);
    return "";
  } catch (const ConfigError& error) {
    return error.what();
  }
}

TEST(BoardSpec, CharucoIsReadWithItsDictionary) {
  const BoardSpec board = parse_board("charuco:9x6:1.2mm:0.9mm:aruco_4x4_50");
  EXPECT_EQ(board.kind, BoardKind::charuco);
  EXPECT_EQ(board.columns, 9);
  EXPECT_EQ(board.rows, 6);
  EXPECT_NEAR(board.square, 1.2e-3, 1e-12);
  EXPECT_NEAR(board.marker, 0.9e-3, 1e-12);
  EXPECT_EQ(board.dictionary, TagFamily::aruco_4x4_50);
  EXPECT_EQ(markers(board), 27);
}

TEST(BoardSpec, CheckerboardCountsSquaresAndHasNoMarkers) {
  const BoardSpec board = parse_board("checkerboard:10x7:25mm");
  EXPECT_EQ(board.kind, BoardKind::checkerboard);
  EXPECT_EQ(board.columns, 10);
  EXPECT_EQ(board.rows, 7);
  EXPECT_NEAR(board.square, 25e-3, 1e-12);
  EXPECT_EQ(markers(board), 0);
}

TEST(BoardSpec, DescriptionReadsBackToTheSameBoard) {
  for (const char* text : {"charuco:9x6:1.2mm:0.9mm:aruco_4x4_50", "checkerboard:13x8:0.805mm",
                           "charuco:5x7:30mm:22.125mm:apriltag_36h11"}) {
    EXPECT_EQ(describe(parse_board(text)), text);
  }
}

TEST(BoardSpec, WhatIsNoBoardIsRefusedOnOneLineWithTheForm) {
  for (const char* text :
       {"", "charuco", "chess:9x6:1mm", "charuco:9x6:1.2mm", "checkerboard:9x6:1mm:0.5mm:x",
        "charuco:9:1.2mm:0.9mm:aruco_4x4_50", "checkerboard:9x6x2:1mm", "checkerboard:9x:1mm",
        "checkerboard:9x6:1", "checkerboard:9x6:1.2 mm", "checkerboard:9x6:nanmm",
        "checkerboard:9x6:mm", "checkerboard:9.5x6:1mm", "checkerboard:99999999999x6:1mm"}) {
    const std::string why = refusal(text);
    EXPECT_NE(why.find("charuco:COLUMNSxROWS"), std::string::npos) << text << ": " << why;
    EXPECT_EQ(why.find('\n'), std::string::npos) << text;
  }
}

TEST(BoardSpec, BoardThatCannotBeMadeIsRefusedWithTheReason) {
  EXPECT_NE(refusal("checkerboard:2x6:1mm").find("2 squares"), std::string::npos);
  EXPECT_NE(refusal("checkerboard:9x-6:1mm").find("-6 squares"), std::string::npos);
  EXPECT_NE(refusal("checkerboard:9x6:0mm").find("squares of 0 mm"), std::string::npos);
  EXPECT_NE(refusal("checkerboard:9x6:infmm").find("no length"), std::string::npos);
  EXPECT_NE(refusal("charuco:9x6:1mm:1mm:aruco_4x4_50").find("smaller"), std::string::npos);
  EXPECT_NE(refusal("charuco:9x6:1mm:-1mm:aruco_4x4_50").find("smaller"), std::string::npos);
  EXPECT_NE(refusal("charuco:9x6:1mm:0.7mm:dict_4x4").find("'dict_4x4'"), std::string::npos);
  EXPECT_NE(refusal("charuco:11x10:1mm:0.7mm:aruco_4x4_50").find("55 markers"), std::string::npos);
}

}  // namespace
}  // namespace tagwrench
