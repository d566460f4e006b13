// Frames through the methods that are compared.
#pragma once

#include <memory>
#include <vector>

#include "tests/bench/tracker_scores.h"

namespace tagwrench::bench {

using Methods = std::vector<std::unique_ptr<Method>>;
using Records = std::vector<std::vector<Record>>;  ///< of each method

double thread_time_us();  ///< processor time of this thread

/// Every method sees every frame. Frames come in chunks and each method works through a chunk on
/// its own, as it would on a stream.
Records run(ShotSource& source, const Methods& methods);

/// Processor time in which a target is found that was covered in the frame before: every sixth
/// moving frame is turned grey, and the one after it shows the tags where they are by then. Median,
/// us; NaN if it is not found there in half of them.
double found_again_us(ShotSource& source, Method& method);

}  // namespace tagwrench::bench
