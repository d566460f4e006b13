// A board that is a process: the serial port is a pseudo-terminal, the amplifiers, the ADC and the
// buttons are simple models, the LED is a line on standard error. For development without an
// emulator; its clock is this machine's, so nothing about time can be measured with it.
#pragma once

#include <string>

namespace tagwrench {
namespace board {

/// What is wired to a load-cell channel.
enum class CellModel {
  sine,      ///< a force that goes slowly up and down
  constant,  ///< of `force_n`
  none,      ///< nothing: its data line stays high
  stuck,     ///< its data line stays low
};

struct Cell {
  CellModel model;
  double force_n;
};

/// Opens a pseudo-terminal and makes `link` a symbolic link to it, in place of an old one. False
/// with errno set if that cannot be.
bool open_port(const std::string& link);
void wire_cell(unsigned channel, const Cell& cell);
/// Presses a button for 0.2 s.
void press_button(unsigned button);

/// Lets time pass: sleeps until something comes on the port or on standard input, or something is
/// due, and obeys the lines on standard input.
void wait();

}  // namespace board
}  // namespace tagwrench
