// Image -> tag corners and first poses. The only place in this room that knows OpenCV; it costs
// milliseconds and allocates, and runs only while the target is not held.
#pragma once

#include <array>
#include <memory>
#include <optional>
#include <vector>

#include "host/tracker/camera_model.h"
#include "host/tracker/edges.h"
#include "host/tracker/target.h"
#include "host/types.h"

namespace tagwrench {

struct FoundTag {
  std::size_t index = 0;  ///< in TargetDescription::tags
  std::array<Eigen::Vector2d, 4>
      corners_px;  ///< top left first, clockwise as printed; flipped back if mirrored
  /// One or two poses that a square's four corners allow (Collins and Bartoli, "Infinitesimal
  /// plane-based pose estimation", IJCV 109, 2014), smaller reprojection error first. Seen from
  /// behind or behind the lens: left out.
  std::vector<Eigen::Isometry3d> camera_T_tag;
};

struct Finding {
  std::vector<FoundTag> tags;
  bool other_way_round = false;  ///< nothing here, but tags in the image flipped the other way
  // In the image as described, flipped back if mirrored; px.
  std::vector<int> other_ids;  ///< tags of the family, but not of the target
  std::vector<int> twice;      ///< tags of the target that are in more than one place
  std::vector<std::array<Eigen::Vector2d, 4>> squares;  ///< four corners, but no tag of the target
};

class Acquirer {
 public:
  /// Throws ConfigError for a target without tags, with too many, with an id twice or outside the
  /// family.
  Acquirer(const CameraModel& camera, const TargetDescription& target);
  ~Acquirer();
  Acquirer(const Acquirer&) = delete;
  Acquirer& operator=(const Acquirer&) = delete;

  /// The tags as printed, in the target's order.
  const std::vector<TagPattern>& patterns() const noexcept { return patterns_; }

  /// Never throws.
  Finding find(const ImageView& image) noexcept;

 private:
  struct Detector;
  Finding search(const ImageView& image);

  CameraModel camera_;
  TargetDescription target_;
  std::vector<TagPattern> patterns_;
  std::unique_ptr<Detector> detector_;
  unsigned misses_ = 0;
};

}  // namespace tagwrench
