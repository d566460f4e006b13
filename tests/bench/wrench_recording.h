// What recording adds to the life of a frame.
#pragma once

#include "tests/bench/table.h"

namespace tagwrench::bench {

/// Into the folder for temporary files, about 100 MB, removed again.
void bench_recording(Table& table);

}  // namespace tagwrench::bench
