// Frames with exact truth for the tracker's benchmark: 25 at rest, then motion or a series of fixed
// poses.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "host/core/types.h"
#include "host/source/simulator/scenario.h"

namespace tagwrench::bench {

enum class Phase : std::uint8_t {
  rest,    ///< the target's geometry may be learned
  travel,  ///< to where the next figures are taken; counts for nothing
  moving,
  held  ///< at the fixed pose number `pose`
};

/// One frame and what it shows. Pixels are 8-bit grey, without padding between rows.
struct Shot {
  std::vector<std::uint8_t> pixels;
  int width = 0;
  int height = 0;
  std::uint64_t sequence = 0;
  TimePoint time{};
  Phase phase = Phase::rest;
  int pose = 0;
  Vector6 truth = Vector6::Zero();  ///< displacement from rest, m and rad

  ImageView image() const { return {pixels.data(), width, height, width}; }
};

class ShotSource {
 public:
  virtual ~ShotSource() = default;
  /// The next frame; false at the end.
  virtual bool next(Shot& shot) = 0;
};

constexpr int kRestFrames = 25;

/// The scenario as it runs, with the platform's dynamics, motion blur and all.
std::unique_ptr<ShotSource> moving_shots(const sim::Scenario& scenario, int moving_frames);

/// The scenario's sensor held still at each of `displacements`, `frames_each` noise realisations;
/// between them it travels slowly enough to be followed. The first frame has the noise of this
/// number, the others the noise of those that follow.
std::unique_ptr<ShotSource> held_shots(const sim::Scenario& scenario,
                                       const std::vector<Vector6>& displacements, int frames_each,
                                       std::uint64_t first_noise = 0);

}  // namespace tagwrench::bench
