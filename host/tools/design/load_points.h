// Where a known weight is hung from a finished sensor.
#pragma once

#include <array>

#include "host/tools/design/geometry.h"
#include "host/tools/design/parameters.h"

namespace tagwrench::hardware {

/// Of the thread, which lies between a screw's head and the wall.
constexpr double kThreadOffWall = 0.5e-3;

/// Right (+x), left, lower (+y), upper; platform frame. In the middle of the roof's edges, half-way
/// up, or in a knob's side at the height of the tags.
std::array<Eigen::Vector3d, 4> load_points(const Parameters& parameters, const Geometry& geometry);

/// What to hang there, kg: the largest usual weight that stays clear of the stops in every
/// direction, with force and torque together.
double load_mass(const Parameters& parameters, const Geometry& geometry);

}  // namespace tagwrench::hardware
