// What the device shows of simulated pushes, in simulated time.
#pragma once

#include "tests/bench/table.h"

namespace tagwrench::bench {

void bench_rest(Table& table);       ///< counts at rest over an hour
void bench_stop(Table& table);       ///< from letting go to zero
void bench_crosstalk(Table& table);  ///< counts on the five axes that nobody pushes
void bench_filter(Table& table);     ///< what filters lag behind

}  // namespace tagwrench::bench
