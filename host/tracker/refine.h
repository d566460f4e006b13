// From a predicted pose and pixels to the pose: the seam at which another method of refinement can
// take over.
//
// The method here is model-based edge fitting: every black-white boundary of all tags gives points,
// each measured by a profile across the edge (edges.h), and one rigid pose is fitted to all
// of them by Gauss-Newton with Tukey weights. Compare Drummond and Cipolla, "Real-time visual
// tracking of complex structures", PAMI 24(7), 2002.
#pragma once

#include <vector>

#include "host/tracker/edges.h"

namespace tagwrench {

enum class Verdict : std::uint8_t {
  held,      ///< the fit is accepted
  doubtful,  ///< something like the target is there, but the fit is poor
  lost,      ///< no fit
};

struct Refinement {
  Eigen::Isometry3d camera_T_platform = Eigen::Isometry3d::Identity();
  Matrix6 covariance = Matrix6::Zero();  ///< of the platform's motion, camera axes: m, rad
  double residual_px = 0;                ///< weighted RMS
  std::uint8_t tags_held = 0;  ///< that carried the fit and whose cells still look like the tag
  Verdict verdict = Verdict::lost;
};

class Refiner {
 public:
  explicit Refiner(const CameraModel& camera) : meter_(camera) {}

  /// Allocates; everything else does not.
  void set_target(EdgeTarget target);
  const EdgeTarget& target() const noexcept { return target_; }

  /// `predicted` must be within about half a cell of the truth in the image. Never throws, never
  /// allocates. A lost verdict leaves the other fields meaningless, but finite.
  Refinement refine(const ImageView& image, const Eigen::Isometry3d& predicted) noexcept;

 private:
  struct Step {
    bool solved = false;
    double size_px = 0;  // RMS change of the image points
  };

  bool converge(const ImageView& image, Refinement& fit) noexcept;
  Step iterate(const ImageView& image, bool coarse, Refinement& fit) noexcept;
  Step solve(double min_scale_px, Refinement& fit) noexcept;
  double robust_scale_px() noexcept;
  int judge_tags(const ImageView& image, const Refinement& fit) noexcept;
  bool looks_like_tag(const ImageView& image, const EdgeTag& tag,
                      const Eigen::Isometry3d& pose) noexcept;
  std::span<EdgeMeasurement> of_tag(std::size_t tag) noexcept;

  EdgeMeter meter_;
  EdgeTarget target_;
  std::vector<EdgeMeasurement> measurements_;  // all tags, in order
  std::vector<std::size_t> first_;             // of each tag, and the end
  std::vector<float> scratch_;
  std::vector<bool> excluded_;  // tags that are covered in this frame
};

}  // namespace tagwrench
