#include "tests/bench/link_board.h"

namespace tagwrench::bench {

void bench_emulated_board(Table& table) {
  table.skipped("firmware on the emulated ATmega328P", TAGWRENCH_NO_BOARD);
}

}  // namespace tagwrench::bench
