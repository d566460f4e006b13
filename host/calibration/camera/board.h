// A calibration board in an image, and the crossing points of its squares to a few hundredths of a
// pixel. Uses OpenCV inside.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "host/calibration/print/board_spec.h"
#include "host/core/types.h"

namespace tagwrench {

/// A crossing of two edges: of squares that are black and white by turns.
struct BoardCorner {
  Eigen::Vector2d board = Eigen::Vector2d::Zero();  ///< in squares, on the board
  Eigen::Vector2d pixel = Eigen::Vector2d::Zero();  ///< px
};

/// How the corners of one image look.
struct CornerView {
  double blur_px = 0;           ///< median standard deviation of the edges' spread
  double spacing_px = 0;        ///< median distance between neighbours
  double contrast = 0;          ///< median of white minus black, grey levels
  double clipped_fraction = 0;  ///< part of all corners, whose white is at the grey scale's top
};

struct RefinedCorners {
  std::vector<BoardCorner> corners;
  CornerView look;
};

/// What is printed in the white squares, in squares.
struct SquareFill {
  bool markers = false;  ///< in the white squares; and square (0, 0) is black
  double gap = 0;        ///< from the square's edge to the marker's
  double ring = 0;       ///< width of the marker's black border
};

/// Fits to the pixels around every corner
///   m + g . d + a (E(u) E(v) - 2 P(u - gap) P(v - gap) - 2 P(-u - gap) P(-v - gap))
/// with u, v the distances (px) from the two edges that cross there, E(u) = erf(u / (sqrt(2) s)),
/// P = (1 + E) / 2; the last two terms are the markers' nearest corners, where there are markers.
/// Blur, contrast and shading are fitted along, so they do not move the corner. Where white is cut
/// off at the top of the grey scale, pixels tell only that the model must be there too (a censored
/// fit: Tobin, "Estimation of relationships for limited dependent variables", Econometrica 26,
/// 1958): the dark side of every edge still places it. A corner is left out when it lies within its
/// blur of the border, has no neighbours to tell the edges' directions, stands off its neighbours'
/// grid, or does not look like a crossing.
RefinedCorners refine_corners(const ImageView& image, const std::vector<BoardCorner>& rough,
                              const SquareFill& fill);

/// What became of one image.
enum class BoardView : std::uint8_t {
  board,        ///< found, sharp enough, and its corners could be placed
  no_board,     ///< nothing like it
  other_board,  ///< markers, but not where this board has them
  part,         ///< too few of its corners
  dark,
  saturated,  ///< and therefore its corners cannot be placed
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

  BoardSighting find(const ImageView& image);

  /// As given, until markers show that it is the other way round: they cannot be read in a mirror.
  /// A checkerboard never tells.
  bool mirrored() const noexcept { return mirrored_; }

 private:
  struct Detector;

  bool mirrored_;
  bool settled_;  ///< markers were read: no more doubt about mirrored_
  std::unique_ptr<Detector> detector_;
};

/// The board that most of the images show, for people: "charuco:11x8 with aruco_4x4_50"; empty if
/// it cannot be told. `asked` is what was looked for.
std::string guess_board(const std::vector<ImageView>& images, const BoardSpec& asked);

}  // namespace tagwrench
