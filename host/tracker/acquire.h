// Image -> tag corners and first poses. Costs milliseconds and allocates, and runs only while the
// target is not held.
#pragma once

#include <algorithm>
#include <vector>

#include "host/core/types.h"
#include "host/tracker/camera_model.h"
#include "host/tracker/edges.h"
#include "host/tracker/square_finder.h"
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
  std::vector<FoundTag> tags;
  bool other_way_round = false;  ///< nothing here, but tags in the image flipped the other way
  // In the image as described, flipped back if mirrored; px.
  std::vector<int> other_ids;   ///< tags of the family, but not of the target
  std::vector<int> twice;       ///< tags of the target that are in more than one place
  std::vector<Square> squares;  ///< four corners, but no tag of the target
};

/// An image, left and right exchanged.
class FlippedImage {
 public:
  explicit FlippedImage(const ImageView& image)
      : width_(image.width),
        height_(image.height),
        pixels_(static_cast<std::size_t>(image.width) * static_cast<std::size_t>(image.height)) {
    for (int row = 0; row < height_; ++row) {
      const std::uint8_t* from = image.pixels + static_cast<std::ptrdiff_t>(row) * image.stride;
      std::reverse_copy(from, from + width_,
                        pixels_.begin() + static_cast<std::ptrdiff_t>(row) * width_);
    }
  }
  ImageView view() const noexcept { return {pixels_.data(), width_, height_, width_}; }

 private:
  int width_;
  int height_;
  std::vector<std::uint8_t> pixels_;
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

}  // namespace tagwrench
