// Can it be built, and will it work? Each complaint names the parameter as the file writes it.
#pragma once

#include <string>
#include <vector>

#include "host/tools/design/geometry.h"
#include "host/tools/design/parameters.h"

namespace tagwrench::hardware {

struct Complaint {
  std::string parameter;  ///< "target.lens_distance_mm"
  std::string message;    ///< what is wrong and what to do
};

/// Empty: it can be built. Looked at over the whole travel: walls and the nozzle, room for springs,
/// lens and LED, springs before they are solid, tags inside the picture and not hidden by springs,
/// cover, plate or the mirror's holder, the lens' focus.
std::vector<Complaint> complaints(const Parameters& parameters, const Geometry& geometry);

/// Where a point of the drawing is seen, px. Behind the lens: not finite.
Eigen::Vector2d seen_at(const Parameters& parameters, const Geometry& geometry,
                        const Eigen::Vector3d& point);

/// The corners of all papers, displaced, drawing frame; those of a tag in the mirror where they
/// seem to be.
std::vector<Eigen::Vector3d> paper_corners(const Parameters& parameters, const Geometry& geometry,
                                           const Vector6& displacement);

/// By how much a helical spring may be shortened before it gives way sideways, m; `length` and
/// `mean_diameter` of the free coils, clamped at both ends, one of which moves sideways. Steel;
/// EN 13906-1, critical deflection with seating coefficient 1. Infinite: never.
double buckling_deflection(double length, double mean_diameter);

}  // namespace tagwrench::hardware
