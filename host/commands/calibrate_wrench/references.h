// The instruments that tell the load, behind one interface.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "host/calibration/wrench/plan.h"
#include "host/calibration/wrench/reference.h"
#include "host/source/simulator/bench.h"

namespace tagwrench {

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
