// The simulated bench with the platform on its springs, without pictures.
#pragma once

#include <cstdint>
#include <functional>

#include "host/source/simulator/bench.h"
#include "host/source/simulator/mechanics.h"

namespace tagwrench::sim {

inline BenchSettings perfect() {
  BenchSettings settings;
  settings.perfect = true;
  return settings;
}

struct BenchRig {
  explicit BenchRig(const BenchSettings& settings, std::uint64_t seed = 1,
                    const Mechanics& springs = {})
      : mechanics(springs),
        bench(settings, seed),
        motion(mechanics, TrajectoryPlayer({}, seed), 0, 0.2, &bench) {}

  void run(double seconds) {
    for (const double end = time + seconds; time < end;) {
      time = std::min(time + 0.01, end);
      motion.advance_to(time);
    }
  }
  /// Until the person's hands are off.
  void finish() {
    while (bench.busy()) run(0.01);
  }
  /// Every millisecond.
  void watch(double seconds, const std::function<void()>& look) {
    for (const double end = time + seconds; time < end; look()) run(1e-3);
  }
  Vector6 displacement() const { return motion.seen(time); }
  Vector6 wrench() const { return motion.applied_wrench(time); }

  Mechanics mechanics;
  Bench bench;
  PlatformMotion motion;
  double time = 0;
};

}  // namespace tagwrench::sim
