#include "host/commands/doctor_command.h"

#include <iostream>
#include <stdexcept>

#include "host/app/sources.h"
#include "host/tools/doctor/doctor.h"

namespace tagwrench {

DoctorCommand::DoctorCommand(command_line::Command program)
    : verb_(program.add_subcommand(
          "doctor", "say line by line what works here and what to do about the rest")) {
  command_line::Option focus = verb_.add_flag(
      "--focus", focus_, "instead, how sharp the tags are, live, while you turn the lens");
  verb_
      .add_option("--source", focusing_.source,
                  source_forms({SourceKind::simulator, SourceKind::camera, SourceKind::images}) +
                      "; without it the only camera")
      .needs(focus);
  verb_
      .add_option("--sensor", focusing_.sensor,
                  "sensor.yaml, for its tags; nothing in it need be calibrated")
      .needs(focus);
  verb_.add_option("--seconds", focusing_.seconds, "end after S seconds")
      .check(command_line::seconds())
      .needs(focus);
}

int DoctorCommand::run() const {
  if (focus_) return run_focus(focusing_);
  const int status = run_doctor(std::cout);
  if (!std::cout.flush())
    throw std::runtime_error("standard output: cannot be written; redirect it somewhere");
  return status;
}

}  // namespace tagwrench
