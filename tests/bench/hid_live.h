// The program's own loop, live, with programs on the spnav socket.
#pragma once

#include "tests/bench/table.h"

namespace tagwrench::bench {

void bench_socket(Table& table);  ///< capture to event, rate and its jitter, idle
void bench_slow(Table& table);    ///< what waits for a reader that does not read
void bench_cpu(Table& table);     ///< processor time of the loop

}  // namespace tagwrench::bench
