// What a person or a test may do to an emulated board while it runs, one line of text each.
#pragma once

#include <optional>
#include <string>

#include "tests/firmware/emulated_board.h"
#include "tests/firmware/pty_line.h"

namespace tagwrench::emulator {

constexpr const char* kOrders =
    "cell N FORCE_N | cell N sine AMPLITUDE_N HZ | cell N connect|disconnect|stuck | adc N VOLT | "
    "supply VOLT | button N press|release | reset | power | hang | unplug | plug | noise "
    "BIT_ERROR_RATE | babble BYTES | quit";

/// Carries out one line. Returns what is wrong with it; nothing if it was done.
std::optional<std::string> carry_out(const std::string& line, EmulatedBoard& board, PtyLine& port);

}  // namespace tagwrench::emulator
