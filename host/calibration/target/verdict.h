// Is what was recorded and found good enough to be written, and what is there to say about it?
#pragma once

#include <string>
#include <vector>

#include "host/calibration/target/adjust.h"
#include "host/calibration/target/recorder.h"

namespace tagwrench {

/// How much the direction changed from which the lens sees the platform: the parallax that tells
/// where the tags' planes lie. Tilting and pushing sideways both change it. rad, over all keyframes
/// and the rest, along the directions of the largest and of the smallest change.
struct ViewSpan {
  double widest = 0;
  double narrowest = 0;
};

ViewSpan view_span(const std::vector<Keyframe>& frames,
                   const Eigen::Isometry3d& rest_camera_T_platform);

/// So many different pictures at least a recording must have.
inline constexpr std::size_t kMinKeyframes = 20;

/// Throws ConfigError, one line with what is missing and what to do, for a recording that cannot
/// show where the tags sit: one tag only, no rest, tags lost, too few different pictures, seen from
/// one side.
void check_record(const TargetRecorder& record, const TargetDescription& target,
                  const ReferenceOptions& rest);

/// Throws ConfigError for an adjustment that must not be believed: no solution, edges off the
/// model, another focal length, nothing learned from the motion, too uncertain.
void check_estimate(const TargetEstimate& estimate, const CameraModel& camera);

/// Standard deviations of a tag's pose in the platform frame: m, rad. The platform's origin moves
/// with the tags.
std::vector<Vector6> platform_sigmas(const Eigen::MatrixXd& covariance);

/// Of the unknowns of all tags, combinations whose standard deviation the motion has brought below
/// this part of that from the rest image alone.
int better_known(const TargetEstimate& estimate, double part);

/// Whether the recording tells that the shutter rolls, and how fast: many sigmas, and a fit that is
/// clearly better with it. A global shutter's never does.
bool readout_is_clear(const TargetEstimate& estimate);

/// Lines for people: what was excited, where the tags are and how well that is known.
std::vector<std::string> describe(const TargetRecorder& record, const TargetEstimate& estimate,
                                  const TargetDescription& target, const CameraModel& camera);

}  // namespace tagwrench
