// The instruments that tell the load, behind one interface; one of them may be emulated.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "host/calibration/wrench/plan.h"
#include "host/calibration/wrench/record.h"
#include "host/core/os/unique_fd.h"
#include "host/source/simulator/bench.h"

namespace tagwrench {

/// What the load cell in the simulated hand feels, as orders for an emulated board, whose cell then
/// sends it as a real one would.
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

struct ReferenceInstrumentOptions {
  std::string board;  ///< port, `auto`; empty: none
  std::string cells;
  std::string optoforce;  ///< port; empty: none
  std::vector<double> counts_per_unit;
  std::string emulated_cell;  ///< where orders for the emulated `board` go; empty: none
};

/// What the plan needs: null for masses. `bench`, borrowed, has simulated ones, or presses the cell
/// of the emulated board; null: real ones.
/// `simulation_start`: time of the bench's second 0. Throws ConfigError if it is not named, not
/// there, or not calibrated.
std::unique_ptr<Reference> open_reference(const WrenchPlan& plan,
                                          const ReferenceInstrumentOptions& options,
                                          const sim::Bench* bench, TimePoint simulation_start);

}  // namespace tagwrench
