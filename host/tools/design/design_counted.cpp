#include <cmath>
#include <numbers>

#include "host/tools/design/design.h"

namespace tagwrench::study {
namespace {

constexpr double kTurn = std::numbers::pi / 4;  // the published estimate looks at 45 degrees

/// 0 where there is not one count.
int bits(double counts) {
  return counts < 1 ? 0 : static_cast<int>(std::floor(std::log2(counts))) + 1;
}

}  // namespace

CountedSteps counted_steps(const CountedPixels& d) {
  const double count_px = 1 / d.counts_per_px;
  CountedSteps steps;
  steps.bits_x = bits(d.counts_per_px * d.travel_x_px());
  steps.bits_y = bits(d.counts_per_px * d.travel_y_px());
  steps.bits_z = steps.bits_y;
  steps.step_xy = d.m_per_px() * count_px;
  // The tag's edge seen one count nearer to the middle, by similar triangles.
  steps.step_z = steps.step_xy / (0.5 * d.tag_with_border - steps.step_xy) * d.lens_distance;
  const double radius_px = std::numbers::sqrt2 * 0.5 * d.tag_px;
  steps.chord_px = 2 * radius_px * std::sin(0.5 * kTurn);
  steps.step_rz = kTurn / steps.chord_px * count_px;
  steps.foreshortening_px = 0.5 * d.tag_px * (1 - std::cos(kTurn));
  steps.step_rxy = kTurn / steps.foreshortening_px * count_px;
  return steps;
}

double counted_force(double range, double travel_px, double counts_per_px) {
  return 2 * range / (counts_per_px * travel_px);
}

}  // namespace tagwrench::study
