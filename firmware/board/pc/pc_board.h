// A board that is a process: the serial port is a pseudo-terminal, the amplifiers, the ADC and the
// buttons are simple models, the LED is a line on standard error. For development without an
// emulator; its clock is this machine's, so nothing about time can be measured with it.
#pragma once

#include <string>

#include "firmware/board/pc/cell_option.h"

namespace tagwrench {
namespace board {

/// Opens a pseudo-terminal and makes `link` a symbolic link to it (port_name.h). Returns what is
/// wrong; nothing if it was done.
std::string open_port(const std::string& link);
/// Removes the link, unless another has it by now.
void close_port();
void wire_cell(unsigned channel, const Cell& cell);
/// Presses a button for 0.2 s.
void press_button(unsigned button);

/// Lets time pass: sleeps until something comes on the port or on standard input, or something is
/// due, and obeys the lines on standard input.
void wait();

}  // namespace board
}  // namespace tagwrench
