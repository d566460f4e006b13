// The half of the link's table that needs the emulated board.
#pragma once

#include "tests/bench/table.h"

namespace tagwrench::bench {

/// Or says why there is none here.
void bench_emulated_board(Table& table);

}  // namespace tagwrench::bench
