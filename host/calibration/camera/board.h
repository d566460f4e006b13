// Finds a calibration board in an image. Uses OpenCV inside.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "host/calibration/camera/corners.h"
#include "host/calibration/print/board_spec.h"
#include "host/core/types.h"

namespace tagwrench {

/// What became of one image.
enum class BoardView : std::uint8_t {
  board,        ///< found, sharp and well lit
  no_board,     ///< nothing like it
  other_board,  ///< markers, but not where this board has them
  part,         ///< too few of its corners
  dark,
  saturated,
  blurred,
};

/// "too dark", as one says it of an image.
const char* words(BoardView look);

struct BoardSighting {
  BoardView look = BoardView::no_board;
  /// Of the image after flipping it back, if mirrored; filled when look is `board`.
  std::vector<BoardCorner> corners;
  CornerView corner_view;
};

class BoardFinder {
 public:
  /// `mirrored`: the camera is said to deliver its image flipped left to right.
  BoardFinder(const BoardSpec& board, bool mirrored);
  ~BoardFinder();
  BoardFinder(const BoardFinder&) = delete;
  BoardFinder& operator=(const BoardFinder&) = delete;

  BoardSighting find(const ImageView& image);

  /// As given, until markers show that it is the other way round: they cannot be read in a mirror.
  /// A checkerboard never tells.
  bool mirrored() const noexcept { return mirrored_; }

 private:
  struct Detector;

  BoardSpec board_;
  bool mirrored_;
  bool settled_ = false;  ///< markers were read: no more doubt about mirrored_
  std::unique_ptr<Detector> detector_;
};

/// The board that most of the images show, for people: "charuco:11x8 with aruco_4x4_50"; empty if
/// it cannot be told. `asked` is what was looked for.
std::string guess_board(const std::vector<ImageView>& images, const BoardSpec& asked);

}  // namespace tagwrench
