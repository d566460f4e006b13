// The Cramer-Rao bound of a scenario, from the simulator's own pictures and from nothing else.
#pragma once

#include <cstdint>
#include <vector>

#include "host/core/types.h"
#include "host/source/simulator/renderer.h"
#include "host/source/simulator/scenario.h"

namespace tagwrench::bench {

struct Bound {
  Vector6 sigma =
      Vector6::Zero();  ///< smallest standard deviation of any unbiased estimate, m, rad
  int pixels = 0;       ///< that were counted
};

/// Pixels: those whose centre lies on one of the papers (the white border's outer edge), whole and
/// flat as glued. Noise: independent, the scenario's read and shot variance plus 1/12 for rounding.
/// Unknown beside the six displacements: a gain and an offset of each tag. Derivatives: central
/// differences of fourth order of pictures rendered without noise and without JPEG, with steps of
/// at most half a pixel. Blur and geometry count as known; JPEG's loss is not in it.
class BoundOfScenario {
 public:
  explicit BoundOfScenario(const sim::Scenario& scenario);
  Bound at(const Vector6& displacement);
  /// Of the six displacements, m^2, m rad, rad^2.
  Matrix6 covariance(const Vector6& displacement);
  /// Largest relative change of any sigma when the steps are 0.6 times as long: the check that the
  /// bound is a property of the pictures and not of the steps.
  double change_with_step(const Vector6& displacement);

 private:
  using Picture = std::vector<std::uint8_t>;
  using Slopes = Eigen::Matrix<double, Eigen::Dynamic, 6>;  ///< grey levels per m or rad
  struct Pixel {
    std::size_t index;
    int tag;
  };

  const Picture& render(const Vector6& displacement, std::uint64_t dither);
  std::vector<Pixel> pixels_on_tags(const Vector6& displacement) const;
  Slopes slopes(const Vector6& displacement, double step_px, const std::vector<Pixel>& pixels,
                std::uint64_t dither);
  Matrix6 covariance(const Vector6& displacement, double step_px, int& count);

  sim::Scenario scenario_;
  sim::TrajectoryPlayer player_;
  sim::Renderer renderer_;
  sim::PlatformMotion motion_;
  Picture picture_;
};

}  // namespace tagwrench::bench
