// What a person or a test may do to an emulated board while it runs, one line of text each.
#pragma once

#include <optional>
#include <string>

#include "firmware/board/pc/cell_option.h"
#include "tests/firmware/emulated_board.h"
#include "tests/firmware/pty_line.h"

namespace tagwrench::emulator {

/// All orders, one line each.
std::string help_on_orders();

/// Carries out one line. Returns what is wrong with it; nothing if it was done.
std::optional<std::string> carry_out(const std::string& line, EmulatedBoard& board, PtyLine& port);

void wire(EmulatedBoard& board, const board::CellOption& option);

}  // namespace tagwrench::emulator
