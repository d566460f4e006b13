// What the pictures of a recording say of the edges of its tags, and the equations of that.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <algorithm>
#include <vector>

#include "host/calibration/target/adjust.h"
#include "host/calibration/target/equations.h"
#include "host/core/robust_statistics.h"
#include "host/tracker/edges.h"

namespace tagwrench {

bool same_edge(const EdgePoint& a, const EdgePoint& b);

/// How far the edges of printed tags lie off the pattern.
struct PrintScatter {
  double robust = 0;     ///< standard deviation of one edge point about pattern and spread, m
  double effective = 0;  ///< what a point counts as: neighbours along an edge err alike, m
};

/// One edge point in one picture.
struct Observation {
  bool valid = false;
  double offset = 0;  // px, true to scale
  EdgeDerivatives by;
};

/// All that is unknown, as far as it is known by now.
struct TargetState {
  std::vector<Eigen::Isometry3d> camera_T_tag;  ///< at rest
  std::vector<PrintModes> print;                ///< of each tag
  Eigen::VectorXd shift;                        ///< of each point, toward white, m
  std::vector<Eigen::Isometry3d> poses;         ///< camera_T_platform of each keyframe
  double readout = 0;                           ///< s
  double focal_ratio = 1;
};

/// Edge points of all tags, those of tag t being first[t] .. first[t+1], in the picture at rest and
/// in the keyframes. `rest` outlives it.
class TargetObservations {
 public:
  /// Points that have no clear edge at rest are left out.
  explicit TargetObservations(const TargetAtRest& rest);

  /// Looks for every edge where `state` has it.
  void observe(const std::vector<Keyframe>& frames, const TargetState& state);
  /// Of each point, from its own offsets in all keyframes: points differ in contrast and in the
  /// length of their profiles.
  void learn_noise();
  void learn_scatter(const TargetState& state);

  /// `square`: prints are taken for square, as far as nothing speaks against it.
  TargetNormal equations(const TargetState& state, bool at_rest_only, bool square = true) const;

  /// `use` is told an observation of the point, its keyframe or -1, and its weight, 1/px^2.
  template <class Use>
  void for_each_offset(Eigen::Index point, const Use& use) const;
  /// How far each point lies off the pattern as a whole was printed, m.
  Eigen::VectorXd off_print(const TargetState& state) const;
  /// 1/m^2. A point off the print tells nothing of the scale, but still of the motion.
  double print_weight(double off) const;

  const Eigen::Isometry3d& camera_T_platform_at_rest() const { return rest_pose_; }
  const std::vector<EdgeTag>& printed() const { return printed_; }
  const std::vector<Eigen::Index>& first() const { return first_; }
  Eigen::Index points() const { return first_.back(); }
  const std::vector<std::vector<Observation>>& moving() const { return moving_; }
  const Eigen::VectorXd& noise_px() const { return noise_px_; }
  const PrintScatter& scatter() const { return scatter_; }

 private:
  void keep_visible();
  PixelView<float> rest_view() const;
  EdgeTag edges(const TargetState& state, std::size_t tag) const;
  template <class Pixel>
  void observe_one(const EdgeMeter& meter, const PixelView<Pixel>& image, const TargetState& state,
                   const Eigen::Isometry3d& pose, const Eigen::VectorXd& late,
                   std::vector<Observation>& out) const;
  Eigen::VectorXd lateness(const std::vector<Observation>& seen, double readout) const;
  double rest_weight(Eigen::Index point) const;
  double weight(const Observation& seen, Eigen::Index point) const;

  const TargetAtRest& rest_;
  Eigen::Isometry3d rest_pose_;
  std::vector<EdgeTag> printed_;
  std::vector<Eigen::Index> first_;  // point of each tag, and the end

  std::vector<Observation> at_rest_;              // of each point
  std::vector<std::vector<Observation>> moving_;  // of each keyframe and point
  Eigen::VectorXd noise_px_;                      // of each point in one keyframe
  PrintScatter scatter_;
};

template <class Use>
void TargetObservations::for_each_offset(Eigen::Index point, const Use& use) const {
  const auto p = static_cast<std::size_t>(point);
  if (at_rest_[p].valid) use(at_rest_[p], -1, rest_weight(point));
  for (std::size_t k = 0; k < moving_.size(); ++k) {
    const Observation& seen = moving_[k][p];
    const double w = weight(seen, point);
    if (w > 0) use(seen, static_cast<int>(k), w);
  }
}

}  // namespace tagwrench
