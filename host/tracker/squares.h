// Squares in an image: found by a library of computer vision (OpenCV in the program, OpenCV.js in a
// web page), the poses that their corners allow, and what is printed in them.
#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "host/tracker/camera_model.h"
#include "host/tracker/target.h"

namespace tagwrench {

/// Corners clockwise, top left first if it is a tag as printed; px.
using Square = std::array<Eigen::Vector2d, 4>;

/// The corners of a square of edge 2 * half about the tag's origin, in that order, m.
inline std::array<Eigen::Vector3d, 4> square_corners(double half) {
  return {{{-half, -half, 0}, {half, -half, 0}, {half, half, 0}, {-half, half, 0}}};
}

inline double shortest_side(const Square& square) {
  double shortest = 1e300;
  for (std::size_t c = 0; c < 4; ++c)
    shortest = std::min(shortest, (square[(c + 1) % 4] - square[c]).norm());
  return shortest;
}

struct SquareList {
  std::vector<int> ids;        ///< of the family
  std::vector<Square> tags;    ///< one for each id
  std::vector<Square> others;  ///< four corners, but no tag of the family
};

class SquareFinder {
 public:
  explicit SquareFinder(TagFamily family);
  ~SquareFinder();
  SquareFinder(const SquareFinder&) = delete;
  SquareFinder& operator=(const SquareFinder&) = delete;

  /// Tags may be listed more than once. `sharpen`: an unsharp mask goes over the image first. Empty
  /// while the library is not there yet; an empty list where it refuses the image, for one as too
  /// small.
  std::optional<SquareList> find(const ImageView& image, bool sharpen);

 private:
  struct Library;
  std::unique_ptr<Library> library_;
};

/// From a plane in which the square's corners lie at +-1, x right, y down, to where they are; its
/// last number is 1. Not finite for corners in a line.
Eigen::Matrix3d square_homography(const Square& corners);

/// The poses that the corners allow (Collins and Bartoli, "Infinitesimal plane-based pose
/// estimation", IJCV 109, 2014): camera_T_tag, one or two, smaller reprojection error first. Seen
/// from behind or behind the lens: left out. `size` is the edge of the square, m.
std::vector<Eigen::Isometry3d> square_poses(const CameraModel& camera, double size,
                                            const Square& corners);

/// What is printed in a square that the sensor's family does not know: a tag of another family, or
/// one that was printed mirrored.
struct ReadSquare {
  TagFamily family = TagFamily::aruco_original;  ///< the smallest that has this tag
  int id = 0;
  bool mirrored = false;  ///< only of those that are missing
};

/// Reads without any error correction: what is not clearly a tag is left out. `squares` are corners
/// in the image, clockwise, px. Flipped, a tag may read as another one of its family: whether one
/// of `missing` is there mirrored is asked first. Allocates.
std::vector<ReadSquare> read_squares(const ImageView& image, const std::vector<Square>& squares,
                                     TagFamily expected, std::span<const std::int16_t> missing);

}  // namespace tagwrench
