// The reference pose, the tags' placement and their looks (ink spread, ragged print, contrast,
// light), learned from the first frames; and the check of a picture that was loaded.
#pragma once

#include <algorithm>
#include <optional>
#include <vector>

#include "host/tracker/acquire.h"
#include "host/tracker/camera_model.h"
#include "host/tracker/edges.h"
#include "host/tracker/pixel_template.h"
#include "host/tracker/target.h"

namespace tagwrench {

/// What a target at rest is known to be.
struct LearnedReference {
  Eigen::Isometry3d camera_T_platform = Eigen::Isometry3d::Identity();
  EdgeTarget target;
  Eigen::Isometry3d seen_from = Eigen::Isometry3d::Identity();  ///< camera_T_platform in `image`
  Matrix6 pose_covariance = Matrix6::Zero();  ///< of seen_from; for a reference that was given
  Matrix6 sway = Matrix6::Zero();  ///< covariance of the platform's motion while it was learned
  ReferenceImage image;            ///< the average of the first frames, as delivered
  PixelNoise noise;                ///< of one frame
  /// How well each tag's pose is known: of its motion, camera axes, m and rad.
  std::vector<Matrix6> tag_covariance;
  double scale_sigma = 0;  ///< of all distances together, a part: how large the tags really are
};

/// How a platform moves that nobody holds still: in a hand, on a soft table. Motions (camera axes;
/// m, rad; px in the image) count from the first frame.
class RestSway {
 public:
  void begin() { *this = {}; }
  /// `counted`: the frame is one of those that are averaged.
  void add(const Vector6& motion, double motion_px, bool counted);
  /// Of where the platform was in all frames, about the mean of those that were averaged. Zero
  /// where no more is seen than noise.
  Matrix6 covariance() const;

 private:
  int frames_ = 0, counted_ = 0;
  double squares_px_ = 0;
  Vector6 counted_sum_ = Vector6::Zero(), sum_ = Vector6::Zero();
  Matrix6 squares_ = Matrix6::Zero();
};

/// Feed it frames until it is done. It averages them, so that one careful fit at the end sees
/// neither noise nor quantisation; a frame in which the platform has moved starts it again. Where
/// that goes on and on the platform sways: then those frames count in which it is near the first.
class ReferenceEstimator {
 public:
  enum class Progress : std::uint8_t {
    waiting,   ///< not all tags seen
    learning,  ///< this frame counted
    moved,     ///< the platform moved: starts again
    swaying,   ///< it is not near where it was in the frames that count
    done,      ///< learned() is filled
  };

  ReferenceEstimator(const CameraModel& camera, const TargetDescription& target,
                     const ReferenceOptions& options, const std::vector<TagPattern>& patterns);

  /// True while the next add() needs what the acquirer finds in the image.
  bool wants_finding() const noexcept { return frames_ == 0; }

  /// May allocate; frames at rest are few.
  Progress add(const ImageView& image, const Finding& finding);

  const LearnedReference& learned() const { return learned_; }
  int tags_seen() const noexcept { return tags_seen_; }

 private:
  bool start(const ImageView& image, const Finding& finding);
  std::optional<Eigen::Isometry3d> tag_pose(const ImageView& image, const FoundTag& found);
  bool place(const std::vector<Eigen::Isometry3d>& camera_T_tag);
  std::optional<Eigen::Isometry3d> by_given_tag(
      const std::vector<Eigen::Isometry3d>& camera_T_tag) const;
  void accumulate(const ImageView& image);
  double motion_px(const Eigen::Isometry3d& camera_T_platform) const;
  bool finish();
  PixelNoise measure_noise() const;
  double seen_scale_sigma(const Eigen::Isometry3d& camera_T_platform) const;
  Matrix6 distance_covariance(const Eigen::Isometry3d& camera_T_body) const;

  CameraModel camera_;
  TargetDescription description_;
  ReferenceOptions options_;
  std::vector<TagPattern> patterns_;
  EdgeMeter meter_;
  Refiner single_;  // one tag alone
  Refiner joint_;   // all, as placed after the first frame
  int least_frames() const noexcept { return std::max(1, options_.frames); }
  /// A rest of two would have been taken by now.
  bool sways() const noexcept { return held_ > 2 * least_frames(); }

  int frames_ = 0;
  int tags_seen_ = 0;
  int held_ = 0;   // frames in a row with all tags, counted or not
  int apart_ = 0;  // frames in a row that did not count
  RestSway sway_;
  Eigen::Isometry3d first_pose_ = Eigen::Isometry3d::Identity();
  Eigen::Isometry3d last_pose_ = Eigen::Isometry3d::Identity();
  std::vector<float> sum_;
  std::vector<float> squares_;  // of differences between successive frames
  std::vector<std::uint8_t> previous_;
  LearnedReference learned_;
};

struct AppearanceMismatch {
  int id = 0;  ///< of the tag that is not where the poses put it
  /// Correlation of the picture's grey levels with the tag's cells, -1 to 1; of a picture that is
  /// flat there, zero.
  double likeness = 0;
  std::optional<int> seen_id{};  ///< which tag is there instead, where one can be told
};

/// Does a loaded picture of the sensor at rest show this target at its reference pose? The first
/// tag whose cells it does not show. Empty where all are shown, and where nothing can be said:
/// without a picture, a reference pose or the tags' places.
std::optional<AppearanceMismatch> check_appearance(const CameraModel& camera,
                                                   const TargetDescription& target,
                                                   const ReferenceOptions& reference);

}  // namespace tagwrench
