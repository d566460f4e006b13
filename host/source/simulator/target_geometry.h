// Where the tags really sit after somebody has glued them on.
#pragma once

#include <vector>

#include "host/source/simulator/rigid_pose.h"
#include "host/source/simulator/scenario.h"

namespace tagwrench::sim {

struct PlacedTag {
  int id = 0;
  RigidPose platform_T_tag;
};

/// Nominal placement plus seeded errors, shifted so that the midpoint of the tag centres is the
/// platform's origin.
std::vector<PlacedTag> placed_tags(const Scenario& scenario);

/// camera_T_platform at a displacement from rest: R_now = exp(r), since the platform's axes are the
/// camera's at rest.
RigidPose platform_pose(const Target& target,
                        const Eigen::Matrix<double, 6, 1>& displacement) noexcept;

}  // namespace tagwrench::sim
