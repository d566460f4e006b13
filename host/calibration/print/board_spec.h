// The calibration board in one string, as it is printed on the sheet and typed on the command line:
//
//   charuco:COLUMNSxROWS:SQUAREmm:MARKERmm:DICTIONARY    charuco:9x6:1.2mm:0.9mm:aruco_4x4_50
//   checkerboard:COLUMNSxROWS:SQUAREmm                   checkerboard:9x6:1.2mm
//
// Columns and rows count squares, for the checkerboard too: it has one inner corner less each way.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "host/tracker/target.h"

namespace tagwrench {

enum class BoardKind : std::uint8_t { charuco, checkerboard };

struct BoardSpec {
  BoardKind kind = BoardKind::charuco;
  int columns = 9;         ///< squares across
  int rows = 6;            ///< squares down
  double square = 1.2e-3;  ///< edge of a square, m
  double marker = 0.9e-3;  ///< edge of a marker's black square, m; charuco only
  TagFamily dictionary = TagFamily::aruco_4x4_50;  ///< charuco only; ids 0 to markers() - 1
};

/// Markers on the board: one in each white square of a charuco board.
int markers(const BoardSpec& board);

/// Throws ConfigError when the text is no board or the board cannot be made: fewer than 3 squares
/// a side, markers that do not fit their squares, more markers than the dictionary has ids.
BoardSpec parse_board(std::string_view text);

/// The inverse of parse_board().
std::string describe(const BoardSpec& board);

/// Throws ConfigError as parse_board() does, for a board put together elsewhere.
void check(const BoardSpec& board);

}  // namespace tagwrench
