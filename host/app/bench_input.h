// A source with somebody at hand who does what is asked: a person before a camera, the simulated
// one at the simulated sensor.
#pragma once

#include <memory>

#include "host/app/input.h"
#include "host/source/simulator/bench.h"

namespace tagwrench {

/// The bench outlives the source, which asks it for the load.
struct BenchInput {
  std::unique_ptr<sim::Bench> bench;  ///< null unless the source is the simulated sensor
  TimePoint time_zero{};              ///< of the bench, on the frames' clock
  Input input;
};

/// As open_input(); but the simulated sensor is loaded by a bench, in place of its scenario's
/// trajectory; with `fast` it runs on a virtual clock, else in real time.
BenchInput open_at_bench(const InputOptions& options);

}  // namespace tagwrench
