#include "host/motion/dead_zone.h"

#include <algorithm>
#include <cmath>

namespace tagwrench {
namespace {

/// Of full scale: where deflection begins is never quite nothing, which stands for rest.
constexpr double kNearest = 1e-12;

}  // namespace

double DeadZone::deflection(double smooth, double raw, const Edges& edges) noexcept {
  const double push = std::abs(smooth);
  const double nearest = kNearest * edges.full_scale;
  const bool turned = std::signbit(smooth) != std::signbit(zero_);
  double zero = turned ? 0 : std::abs(zero_);
  if (zero == 0 && push > edges.outer) zero = std::max(edges.outer, nearest);
  if (push <= edges.inner || std::abs(raw) <= edges.inner) zero = 0;
  if (zero == 0) {
    zero_ = 0;
    return 0;
  }
  const double onward = std::max(0.0, push - edges.outer);
  if (onward > 0 && edges.outer > 0)
    zero = std::min(zero, edges.outer - (edges.outer - edges.inner) * onward / edges.outer);
  zero = std::max({zero, edges.inner, nearest});
  zero_ = std::copysign(zero, smooth);
  return std::copysign(std::clamp((push - zero) / (edges.full_scale - zero), 0.0, 1.0), smooth);
}

}  // namespace tagwrench
