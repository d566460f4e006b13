// Image -> tag corners and first poses of the tags and of the target, and where a pose puts the
// corners. Squares in an image are found by a library of computer vision (OpenCV in the program,
// OpenCV.js in a web page); here are the poses that their corners allow, and what is printed in
// them. Finding costs milliseconds and allocates, and runs only while the target is not held.
#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <iterator>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "host/core/types.h"
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

struct FoundTag {
  std::size_t index = 0;  ///< in TargetDescription::tags
  Square corners_px;      ///< as printed; flipped back if mirrored
  /// One or two poses that the corners allow, smaller reprojection error first.
  std::vector<Eigen::Isometry3d> camera_T_tag;
};

struct Finding {
  bool looked = true;  ///< false: nobody could yet, and the rest is empty
  std::vector<FoundTag> tags{};
  bool other_way_round = false;  ///< nothing here, but tags in the image flipped the other way
  // In the image as described, flipped back if mirrored; px.
  std::vector<int> other_ids{};   ///< tags of the family, but not of the target
  std::vector<int> twice{};       ///< tags of the target that are in more than one place
  std::vector<Square> squares{};  ///< four corners, but no tag of the target
};

/// An image, left and right exchanged.
struct FlippedImage {
  explicit FlippedImage(const ImageView& image) : width(image.width), height(image.height) {
    for (int row = 0; row < height; ++row) {
      const std::uint8_t* from = image.pixels + static_cast<std::ptrdiff_t>(row) * image.stride;
      std::reverse_copy(from, from + width, std::back_inserter(pixels));
    }
  }
  ImageView view() const noexcept { return {pixels.data(), width, height, width}; }

  int width, height;
  std::vector<std::uint8_t> pixels;
};

class Acquirer {
 public:
  /// Throws ConfigError for a target without tags, with too many, with an id twice or outside the
  /// family.
  Acquirer(const CameraModel& camera, const TargetDescription& target);

  /// The tags as printed, in the target's order.
  const std::vector<TagPattern>& patterns() const noexcept { return patterns_; }

  Finding find(const ImageView& image);
  /// Looks at a part of the image alone, and only at the way round that the camera has. Everything
  /// found is in px of the whole image.
  Finding find_in(const ImageView& image, const Region& part);

 private:
  /// `origin`: of the image in the one that the camera's model describes, px.
  Finding detect(const ImageView& image, const Eigen::Vector2d& origin);
  void add_sharpened(const ImageView& image, SquareList& list);

  CameraModel camera_;
  TargetDescription target_;
  SquareFinder finder_;
  std::vector<TagPattern> patterns_;
  unsigned misses_ = 0;
};

/// Minimises the reprojection error of all corners together. Starts from every pose that any tag
/// alone allows and from the reference pose, and keeps the best end within reach of it: a
/// flipped solution never does. Empty when none is left.
std::optional<Eigen::Isometry3d> pose_from_corners(
    const CameraModel& camera, double tag_size, const std::vector<FoundTag>& found,
    const std::vector<Eigen::Isometry3d>& platform_T_tag, const Eigen::Isometry3d& reference);

/// Is the pose one that a platform on springs can reach from rest?
bool within_reach(const Eigen::Isometry3d& reference, const Eigen::Isometry3d& camera_T_platform);

/// Fills `corners` and `corner_count` of the track: one entry for each tag of the target, in its
/// order. `platform_T_tag` is as long as the target's tags, or nothing is filled; nor is it where a
/// corner would lie behind the lens. No heap.
void set_corners(const CameraModel& camera, const TargetDescription& target,
                 const std::vector<Eigen::Isometry3d>& platform_T_tag,
                 const Eigen::Isometry3d& camera_T_platform, Track& track) noexcept;

}  // namespace tagwrench
