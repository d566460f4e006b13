// Room calibration/check: whether a sensor in use still measures what it did.
// In:  means over seconds: tags (m, rad), light (grey levels), blur (px^2), loads (N).
// Out: findings: fine or off, by how much, and what to do again.
// Then: reference_monitor.h (a load cell that is there for good), focus_guide.h (turning the lens).
//
// Whether a calibrated sensor is still the one that was calibrated: numbers from a few seconds with
// hands off, and from a known load, in; what is wrong, out.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "host/calibration/check/reference_monitor.h"
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
  double amount = 0;
  double expected = 0;
  double sigma = 0;
  int tag = 0;
  int axis = 0;
  Vector6 move = Vector6::Zero();  ///< of the tag's centre, m and rad, camera axes

  bool fine() const { return fault == Fault::none; }
};

struct InSituLimits {
  double sigmas = 3;
  double slip = 5e-6;        ///< m; what light and print do to a tag that has not moved
  double slip_angle = 2e-3;  ///< rad
  double blur_px2 = 0.15;    ///< either way
  double residual_fraction = 0.05;
  double darkest = 50;      ///< white, counts
  double dimmed = 0.5;      ///< white over that at rest
  double clipped = 0.05;    ///< more of the tags than at rest
  double zero = 0.02;       ///< of the range
  double elsewhere = 0.10;  ///< of the range
  double scale = 0.02;
  double off_line = 0.05;  ///< of the range
};

/// One for each subject but scale, in their order.
std::vector<InSituFinding> judge(const AtRest& rest, const InSituLimits& limits = {});

/// Measured over known, by least squares over the six axes, each as well as it is known.
InSituFinding judge(const ProofLoad& load, const InSituLimits& limits = {});

/// The same by a load cell through which somebody has pushed.
InSituFinding judge(const ReferenceMonitor& monitor, const InSituLimits& limits = {});

}  // namespace tagwrench
