// A chosen sensor as OpenSCAD takes it: every number that the parts need, in mm and degrees.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "host/tools/design/geometry.h"
#include "host/tools/design/parameters.h"
#include "host/tracker/edges.h"

namespace tagwrench::hardware {

// Where a known weight is hung from a finished sensor.

/// Of the thread, which lies between a screw's head and the wall.
constexpr double kThreadOffWall = 0.5e-3;

/// Right (+x), left, lower (+y), upper; platform frame. In the middle of the roof's edges, half-way
/// up, or in a knob's side at the height of the tags.
std::array<Eigen::Vector3d, 4> load_points(const Parameters& parameters, const Geometry& geometry);

/// What to hang there, kg: the largest usual weight that stays clear of the stops in every
/// direction, with force and torque together.
double load_mass(const Parameters& parameters, const Geometry& geometry);

/// Assignments, one a line: of what stands in the file under its own name without the unit
/// (`springs_free_length = 25.4;`), and of what follows from it (`z_cover_top = ...;`).
/// `patterns`: what is printed on each of the geometry's tags.
std::string scad_parameters(const Parameters& parameters, const Geometry& geometry,
                            const std::vector<TagPattern>& patterns);

}  // namespace tagwrench::hardware
