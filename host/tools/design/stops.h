// When what moves meets what stands still: the stop screws in their slots, the hood and the cover.
#pragma once

#include "host/tools/design/geometry.h"

namespace tagwrench::hardware {

/// Whether something has met under this displacement (m, rotation vector in rad), turned in full:
/// at 5 degrees what small angles leave out is as much as a twentieth of the travel.
bool stopped(const Parameters& parameters, const Geometry& geometry, const Vector6& displacement);

/// The part of the travel that a displacement takes: 1 where, on its way from rest or on the way
/// opposite, something is about to be met.
double share_of_travel(const Parameters& parameters, const Geometry& geometry,
                       const Vector6& displacement);

}  // namespace tagwrench::hardware
