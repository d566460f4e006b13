// Whether each printed part holds what is put into it: what checks.h asks beside views and travel.
#pragma once

#include <vector>

#include "host/tools/design/checks.h"

namespace tagwrench::hardware {

/// Screws and their threads, roof and ledge, ears or base, mirror and its holder.
std::vector<Complaint> part_complaints(const Parameters& parameters, const Geometry& geometry);

/// By how much a helical spring may be shortened before it gives way sideways, m; `length` and
/// `mean_diameter` of the free coils, clamped at both ends, one of which moves sideways. Steel;
/// EN 13906-1, critical deflection with seating coefficient 1. Infinite: never.
double buckling_deflection(double length, double mean_diameter);

}  // namespace tagwrench::hardware
