// Six numbers of a pose or a wrench, in the order of host/core/types.h.
#pragma once

#include "host/core/types.h"

namespace tagwrench::test {

inline Vector6 six(double x, double y, double z, double rx, double ry, double rz) {
  return (Vector6() << x, y, z, rx, ry, rz).finished();
}

}  // namespace tagwrench::test
