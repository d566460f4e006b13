// Room calibration/check: whether a sensor in use still measures what it did.
// In:  means over seconds: tags (m, rad), light (grey levels), blur (px^2), loads (N).
// Out: findings: fine or off, by how much, and what to do again.
//
// The numbers come from a few seconds with hands off, and from a known load.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "host/core/types.h"

namespace tagwrench {

/// One tag tracked alone, standing still, against the picture at rest.
struct TagAtRest {
  int id = 0;
  bool held = false;
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();  ///< calibrated, platform frame, m
  Vector6 displacement = Vector6::Zero();            ///< mean, of the platform as this tag has it
  Matrix6 covariance = Matrix6::Zero();              ///< of one frame's
  double residual_fraction = 0;                      ///< mean; see Track
  double blur_px2 = 0;                               ///< mean
};

/// How bright the tags are, and how wide their edges.
struct TagPicture {
  double white_counts = 0;        ///< grey level of their white, 0..255
  double clipped_fraction = 0;    ///< of their pixels, 0..1
  std::optional<double> blur_px;  ///< standard deviation of the edges' blur, good to a third
};

/// A few seconds with hands off.
struct AtRest {
  int frames = 0;       ///< standing still
  int rest_frames = 1;  ///< averaged in the picture at rest
  std::vector<TagAtRest> tags;
  TagPicture now, then;
  bool held = false;                 ///< all tags together, in the frames that stood still
  double residual_fraction = 0;      ///< of that, mean
  Vector6 wrench = Vector6::Zero();  ///< mean, less the zero that was set
  Vector6 range = Vector6::Zero();   ///< N, N m; an axis without one is not judged
};

/// A known load and what the sensor made of it, both as changes from the rest before it.
struct ProofLoad {
  Vector6 known = Vector6::Zero();  ///< N, N m
  Matrix6 known_covariance = Matrix6::Zero();
  Vector6 measured = Vector6::Zero();
  Matrix6 measured_covariance = Matrix6::Zero();
  Vector6 range = Vector6::Zero();
};

enum class Subject : std::uint8_t { light, focus, tags, residual, zero, scale };

enum class Fault : std::uint8_t {
  none,
  not_known,       ///< cannot be told: too few tags, or another fault is in the way
  too_dark,        ///< amount: white now; expected: at rest
  too_bright,      ///< amount: part of the tags that is clipped; expected: at rest
  out_of_focus,    ///< amount: growth of the edges' variance, px^2; or blur in px, where
                   ///< `expected` is that at rest
  tag_not_seen,    ///< tag
  tag_moved,       ///< tag; move
  some_tag_moved,  ///< they disagree, but which is wrong cannot be told; move
  residual_grown,  ///< amount: of the contrast; expected: what it may be
  zero_drifted,    ///< amount: of the range, on `axis`
  rest_elsewhere,  ///< the same, by so much that it is no drift
  scale_wrong,     ///< amount: measured over known, sigma
  load_elsewhere,  ///< amount: part of the load that lies off its line, of the range, on `axis`
};

struct InSituFinding {
  Subject subject = Subject::light;
  Fault fault = Fault::none;
  double amount = 0, expected = 0, sigma = 0;
  int tag = 0, axis = 0;
  Vector6 move = Vector6::Zero();  ///< of the tag's centre, m and rad, camera axes

  bool fine() const { return fault == Fault::none; }
};

/// One for each subject but scale, in their order.
std::vector<InSituFinding> judge(const AtRest& rest);

/// Measured over known, by least squares over the six axes, each as well as it is known.
InSituFinding judge(const ProofLoad& load);

// A sensor beside a load cell that stays on it for good: scale and zero, compared all the time.

enum class ReferenceFault : std::uint8_t { none, scale, zero };

/// A straight line through what the sensor measured along the cell's line of action, over what the
/// cell felt: its slope is the scale, its value at no force the zero. Weighted least squares that
/// forgets exponentially, with Huber's weights against what does not belong. Pure; no heap.
class ReferenceMonitor {
 public:
  /// `wrench`: as measured; `line`: the wrench of 1 N along the line, in the same frame; `range`:
  /// of the axes, 0 where it is not known; `force`: what the cell felt at that time, N. A fault is
  /// returned once for each cause.
  ReferenceFault add(TimePoint time, const Vector6& wrench, const Vector6& line,
                     const Vector6& range, double force) noexcept;

  double scale() const noexcept { return slope_; }              ///< measured over known
  double scale_sigma() const noexcept { return slope_sigma_; }  ///< infinite: not known yet
  double zero() const noexcept { return zero_; }                ///< N, along the line
  double zero_sigma() const noexcept { return zero_sigma_; }
  /// Force that the range allows along the line, N.
  double range() const noexcept { return range_; }

 private:
  struct Suspicion {
    double lasted = 0;  ///< s
    bool told = false;
  };
  void fit() noexcept;
  bool confirmed(Suspicion& suspicion, bool now, double dt) const noexcept;

  bool started_ = false;
  TimePoint last_{};
  double range_ = 0;
  double weight_ = 0, independent_ = 0;
  // Of force and measured.
  Eigen::Vector2d mean_ = Eigen::Vector2d::Zero();
  Eigen::Matrix2d scatter_ = Eigen::Matrix2d::Zero();  ///< about the means
  double slope_ = 0, slope_sigma_ = 1e300;
  double zero_ = 0, zero_sigma_ = 1e300;
  double residual_ = 0;  ///< standard deviation, N
  Suspicion scale_fault_, zero_fault_;
};

/// The scale by a load cell through which somebody has pushed.
InSituFinding judge(const ReferenceMonitor& monitor);

// From the width of edges, frame by frame while somebody turns a lens, to what to do next.

enum class FocusTurn : std::uint8_t {
  begin,     ///< nothing to compare with yet
  sharper,   ///< go on
  blurrier,  ///< turn back
  away,      ///< nobody turns, and it was sharper before
  try_on,    ///< nobody turns, the best so far, but it may get better still
  best,      ///< nobody turns, and either way it is worse
};

/// All widths are standard deviations, px.
class FocusGuide {
 public:
  /// `tags` says which tags the width is of, one bit each: when others come into view, what was
  /// before does not compare.
  void add(TimePoint time, double width_px, unsigned tags);

  FocusTurn turn() const { return turn_; }
  double now_px() const { return now_px_; }
  double best_px() const { return best_px_; }  ///< held for two frames at least
  /// Growth of the noise over that at the best, 0: none. It goes with the root of the blur, the
  /// pixel's own width included (study/design.h).
  double more_noise() const;

 private:
  struct Seen {
    TimePoint time;
    double width_px;
  };
  std::vector<Seen> seen_;  ///< of the last second
  unsigned tags_ = 0;
  double now_px_ = 0, best_px_ = 0;
  double dip_px_ = 0;                                ///< the best when it last got clearly better
  double worst_before_px_ = 0, worst_since_px_ = 0;  ///< that
  FocusTurn turn_ = FocusTurn::begin;
};

}  // namespace tagwrench
