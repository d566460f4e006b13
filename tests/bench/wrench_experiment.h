// The paper's experiment in the simulated rig, end to end through rendered frames.
#pragma once

#include "tests/bench/table.h"

namespace tagwrench::bench {

/// Every method's held-out figures with an ideal reference and with the OptoForce model, and what
/// the calibrated model costs. About `moving_frames` at 25 frames a second.
void bench_experiment(int moving_frames, Table& table);

}  // namespace tagwrench::bench
