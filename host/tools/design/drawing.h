// A chosen sensor as OpenSCAD takes it: every number that the parts need, in mm and degrees.
#pragma once

#include <string>
#include <vector>

#include "host/tools/design/geometry.h"
#include "host/tools/design/parameters.h"
#include "host/tracker/edges.h"

namespace tagwrench::hardware {

/// Assignments, one a line: of what stands in the file under its own name without the unit
/// (`springs_free_length = 25.4;`), and of what follows from it (`z_cover_top = ...;`).
/// `patterns`: what is printed on each of the geometry's tags.
std::string scad_parameters(const Parameters& parameters, const Geometry& geometry,
                            const std::vector<TagPattern>& patterns);

}  // namespace tagwrench::hardware
