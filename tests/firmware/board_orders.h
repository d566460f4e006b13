// What a person or a test may do to an emulated board while it runs, one line of text each.
#pragma once

#include <chrono>
#include <optional>
#include <string>

#include "firmware/board/pc/cell_option.h"
#include "tests/firmware/emulated_board.h"
#include "tests/firmware/pty_line.h"

namespace tagwrench::emulator {

/// All orders, one line each.
std::string help_on_orders();

/// Carries out one line. `start`, borrowed for as long as the board runs: CLOCK_MONOTONIC at its
/// virtual time 0. Returns what is wrong with the line; nothing if it was done.
std::optional<std::string> carry_out(const std::string& line, EmulatedBoard& board, PtyLine& port,
                                     const std::chrono::steady_clock::time_point& start);

void wire(EmulatedBoard& board, const board::CellOption& option);

}  // namespace tagwrench::emulator
