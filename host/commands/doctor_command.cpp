#include "host/commands/doctor_command.h"

#include <filesystem>
#include <iostream>
#include <stdexcept>
#include <system_error>

#include "host/app/sources.h"
#include "host/core/config_error.h"
#include "host/core/os/config_folder.h"
#include "host/sensor/sensor_config.h"
#include "host/tools/doctor/doctor.h"

namespace tagwrench {
namespace {

/// What is in force for this sensor.yaml, or else for the one that `run` takes by itself.
void say_sensor(std::string file) {
  const std::string folder = config_folder();
  std::error_code error;
  if (file.empty() && !folder.empty() && std::filesystem::exists(folder + "/sensor.yaml", error))
    file = folder + "/sensor.yaml";
  if (file.empty()) return;
  Report report(std::cout);
  try {
    const SensorConfig sensor = load_sensor(file);
    report.line(Mark::ok, "sensor " + file);
    for (const std::string& line : in_force(sensor)) report.line(Mark::ok, line);
  } catch (const ConfigError& e) {
    report.line(Mark::missing, e.what());
  }
}

}  // namespace

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
  verb_.add_option("--sensor", focusing_.sensor,
                   "sensor.yaml, to say what is in force for it; without it the one of the "
                   "configuration folder. With --focus for its tags: nothing need be calibrated");
  verb_.add_option("--seconds", focusing_.seconds, "end after S seconds")
      .check(command_line::seconds())
      .needs(focus);
}

int DoctorCommand::run() const {
  if (focus_) return run_focus(focusing_);
  const int status = run_doctor(std::cout);
  say_sensor(focusing_.sensor);
  if (!std::cout.flush())
    throw std::runtime_error("standard output: cannot be written; redirect it somewhere");
  return status;
}

}  // namespace tagwrench
