// The commands of the program: each declares its options below `program` and says what it runs,
// which returns the exit status. Begin with run_command.cpp.
#pragma once

#include <cstdio>
#include <stdexcept>
#include <string>

#include "host/core/command_line/command_line.h"

namespace tagwrench {

void analyze_command(command_line::Command program);
void board_command(command_line::Command program);
void calibrate_command(command_line::Command program);
void camera_timing_command(command_line::Command program);
void certificate_command(command_line::Command program);
void check_command(command_line::Command program);
void control_command(command_line::Command program);
void design_command(command_line::Command program);
void doctor_command(command_line::Command program);
void export_command(command_line::Command program);
void gadget_command(command_line::Command program);
void manual_command(command_line::Command program);
void read_command(command_line::Command program);
void record_command(command_line::Command program);
void run_command(command_line::Command program);
void sim_command(command_line::Command program);
void spnav_command(command_line::Command program);
void tags_command(command_line::Command program);
void zero_command(command_line::Command program);

/// The verbs of `tagwrench calibrate`.
void calibrate_camera_command(command_line::Command family);
void calibrate_target_command(command_line::Command family);
void calibrate_wrench_command(command_line::Command family);

/// How long one may take.
inline command_line::Check calibration_seconds() {
  return command_line::number(1, 1e6, "a number of seconds from 1 to 1e6", "SECONDS");
}

/// Data on standard output, written when this returns. Throws std::runtime_error.
inline void print_data(const std::string& text) {
  if (std::fwrite(text.data(), 1, text.size(), stdout) != text.size() || std::fflush(stdout) != 0)
    throw std::runtime_error("standard output: cannot be written; redirect it somewhere");
}

}  // namespace tagwrench
