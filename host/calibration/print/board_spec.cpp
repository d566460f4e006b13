#include "host/calibration/print/board_spec.h"

#include <fmt/format.h>

#include <cmath>
#include <optional>

#include "host/core/config_error.h"
#include "host/core/parse.h"

namespace tagwrench {
namespace {

constexpr int kMinSquares = 3;  // two inner corners each way
constexpr int kMaxSquares = 100;
constexpr double kMinSquare = 0.1e-3;
constexpr double kMaxSquare = 0.5;
constexpr const char* kForm =
    "write charuco:COLUMNSxROWS:SQUAREmm:MARKERmm:DICTIONARY, for example "
    "charuco:9x6:1.2mm:0.9mm:aruco_4x4_50, or checkerboard:COLUMNSxROWS:SQUAREmm";

[[noreturn]] void refuse(std::string_view text, const std::string& why) {
  throw ConfigError("board '{}': {}", text, why);
}

/// "1.2mm" in metres.
std::optional<double> length(std::string_view text) {
  if (!text.ends_with("mm")) return std::nullopt;
  text.remove_suffix(2);
  const auto value_mm = parse_whole<double>(text, std::chars_format::fixed);
  if (!value_mm || !std::isfinite(*value_mm)) return std::nullopt;
  return 1e-3 * *value_mm;
}

}  // namespace

int markers(const BoardSpec& board) {
  return board.kind == BoardKind::charuco ? board.columns * board.rows / 2 : 0;
}

void check(const BoardSpec& board) {
  const std::string text = describe(board);
  for (const int squares : {board.columns, board.rows}) {
    if (squares < kMinSquares || squares > kMaxSquares) {
      refuse(text, fmt::format("{} squares on one side; use {} to {}", squares, kMinSquares,
                               kMaxSquares));
    }
  }
  if (!(board.square >= kMinSquare && board.square <= kMaxSquare)) {
    refuse(text, fmt::format("squares of {} mm; use {} to {} mm", 1e3 * board.square,
                             1e3 * kMinSquare, 1e3 * kMaxSquare));
  }
  if (board.kind == BoardKind::checkerboard) return;
  if (!(board.marker > 0 && board.marker < board.square)) {
    refuse(text,
           "the markers must be smaller than the squares; three quarters of a square is usual");
  }
  if (markers(board) > id_count(board.dictionary)) {
    refuse(text,
           fmt::format("{} markers, but {} has {} ids; use a larger dictionary or fewer squares",
                       markers(board), name(board.dictionary), id_count(board.dictionary)));
  }
}

BoardSpec parse_board(std::string_view text) {
  const std::vector<std::string_view> parts = split(text, ':');
  BoardSpec board;
  if (parts[0] == "charuco" && parts.size() == 5)
    board.kind = BoardKind::charuco;
  else if (parts[0] == "checkerboard" && parts.size() == 3)
    board.kind = BoardKind::checkerboard;
  else
    refuse(text, kForm);
  const std::vector<std::string_view> squares = split(parts[1], 'x');
  const std::optional<int> columns = parse_whole<int>(squares[0]);
  const std::optional<int> rows = squares.size() == 2 ? parse_whole<int>(squares[1]) : std::nullopt;
  if (!columns || !rows) refuse(text, fmt::format("'{}' is no COLUMNSxROWS; {}", parts[1], kForm));
  board.columns = *columns;
  board.rows = *rows;
  const std::optional<double> square = length(parts[2]);
  if (!square) refuse(text, fmt::format("'{}' is no length such as 1.2mm; {}", parts[2], kForm));
  board.square = *square;
  if (board.kind == BoardKind::charuco) {
    const std::optional<double> marker = length(parts[3]);
    if (!marker) refuse(text, fmt::format("'{}' is no length such as 0.9mm; {}", parts[3], kForm));
    board.marker = *marker;
    const std::optional<TagFamily> dictionary = family_from_name(parts[4]);
    if (!dictionary) {
      refuse(text, fmt::format("no dictionary '{}'; use aruco_4x4_50 ... aruco_7x7_1000, "
                               "aruco_original or apriltag_36h11",
                               parts[4]));
    }
    board.dictionary = *dictionary;
  }
  check(board);
  return board;
}

std::string describe(const BoardSpec& board) {
  const bool charuco = board.kind == BoardKind::charuco;
  // Nanometres are enough, and hide the rounding of the conversion to metres.
  const auto mm = [](double length) { return std::round(1e9 * length) * 1e-6; };
  std::string text = fmt::format("{}:{}x{}:{:.8g}mm", charuco ? "charuco" : "checkerboard",
                                 board.columns, board.rows, mm(board.square));
  if (charuco) text += fmt::format(":{:.8g}mm:{}", mm(board.marker), name(board.dictionary));
  return text;
}

}  // namespace tagwrench
