// The paper's own recording through the analysis that `tagwrench analyze` runs.
#pragma once

#include "tests/bench/table.h"

namespace tagwrench::bench {

/// Skipped visibly without TAGWRENCH_DATA.
void bench_real_recording(Table& table);

}  // namespace tagwrench::bench
