// Someone outside the simulation who loads the platform, in place of the scenario's trajectory.
#pragma once

#include "host/core/types.h"

namespace tagwrench::sim {

/// Asked at `time` seconds of the source's simulation time, in the order of time but for the
/// latest frame period: the integration runs ahead to the end of a frame's exposure, and the truth
/// of the frame is asked for afterwards. The same question has the same answer every time.
class AppliedLoad {
 public:
  AppliedLoad() = default;
  AppliedLoad(const AppliedLoad&) = delete;
  AppliedLoad& operator=(const AppliedLoad&) = delete;
  virtual ~AppliedLoad() = default;

  /// N and N m about the platform origin at rest, camera axes. `displacement` is the platform's
  /// just then (m, rad): what takes hold of a point moves with it. Asked several times a step of
  /// the integration.
  virtual Vector6 wrench(double time, const Vector6& displacement) noexcept = 0;

  /// Gravity now less gravity at time 0, m/s^2, camera axes: the platform's own weight pulls
  /// elsewhere when the sensor is held differently.
  virtual Eigen::Vector3d gravity_change(double /*time*/) noexcept {
    return Eigen::Vector3d::Zero();
  }

  /// By how much the platform seems displaced without any load (m, rad): the camera was knocked,
  /// the mount grew warm.
  virtual Vector6 rest_change(double /*time*/) noexcept { return Vector6::Zero(); }

  /// By how much a tag (position in target.tags) has slipped in its own plane: m along its x and
  /// y, rad about its z.
  virtual Eigen::Vector3d slip(int /*tag*/, double /*time*/) noexcept {
    return Eigen::Vector3d::Zero();
  }
};

}  // namespace tagwrench::sim
