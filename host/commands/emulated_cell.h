// What the load cell in the simulated hand feels, as orders for an emulated board, whose cell then
// sends it as a real one would.
#pragma once

#include <string>

#include "host/core/os/unique_fd.h"
#include "host/source/simulator/bench.h"

namespace tagwrench {

class EmulatedCell {
 public:
  /// Borrows the bench. `orders`: the pipe from which the emulated board reads, or a file;
  /// `channel` of the cell there; `simulation_start`: the bench's second 0 on CLOCK_MONOTONIC.
  /// Throws ConfigError if nobody reads the pipe, or it cannot be written.
  EmulatedCell(const std::string& orders, int channel, const sim::Bench& bench,
               TimePoint simulation_start);

  /// Writes what will be felt in the time to come, as far as it is decided. To be called more often
  /// than the bench's reaction time. Does not block; what a full pipe does not take is lost.
  void follow() noexcept;

 private:
  UniqueFd orders_;
  int channel_;
  const sim::Bench& bench_;
  TimePoint start_;
  double told_to_;  ///< s of simulation time
};

}  // namespace tagwrench
