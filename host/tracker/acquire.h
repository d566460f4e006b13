// Image -> tag corners and first poses of the tags and of the target, and where a pose puts the
// corners. Finding costs milliseconds and allocates, and runs only while the target is not held.
#pragma once

#include <algorithm>
#include <iterator>
#include <optional>
#include <vector>

#include "host/core/types.h"
#include "host/tracker/camera_model.h"
#include "host/tracker/edges.h"
#include "host/tracker/squares.h"
#include "host/tracker/target.h"

namespace tagwrench {

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

 private:
  Finding detect(const ImageView& image);
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
