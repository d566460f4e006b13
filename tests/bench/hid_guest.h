// The same on real uhid, uinput and V4L2 drivers with unmodified programs, in the kernel tests'
// guest.
#pragma once

#include "tests/bench/table.h"

namespace tagwrench::bench {

void bench_guest(Table& table);

}  // namespace tagwrench::bench
