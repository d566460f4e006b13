#include "host/commands/read_command.h"

#include "host/core/os/termination.h"

namespace tagwrench {

ReadCommand::ReadCommand(command_line::Command program)
    : verb_(program.add_subcommand(
          "read", "live values of wrench sensors and 6-DOF devices on HID, ours and others")) {
  verb_.footer(
      "Forces are in N, torques in N m; pucks have counts. Rate, jitter (standard deviation and "
      "longest of the intervals), missing frames and latency (capture to arrival here, for a live "
      "sensor on this computer) come with each line and in the summary.");
  verb_.add_option("device", options_.device,
                   "serial, VID:PID or path; without it the only wrench sensor, or else the only "
                   "6-DOF device");
  command_line::Option list = verb_.add_flag("--list", list_, "list what is plugged in, and end");
  command_line::Option seconds =
      verb_.add_option("--seconds", seconds_, "end after S seconds").check(command_line::seconds());
  command_line::Option wait = verb_.add_flag(
      "--wait", options_.wait, "wait for a device that is not there, and again when it is gone");
  command_line::Option json = verb_.add_flag("--json", json_, "one JSON object a report");
  command_line::Option csv = verb_.add_flag("--csv", csv_, "one CSV row a report");
  command_line::Option log =
      verb_.add_option("--log", options_.log, "CSV file to write beside what is printed");
  json.excludes(csv);
  for (command_line::Option other : {seconds, wait, json, csv, log}) list.excludes(other);
}

int ReadCommand::run() {
  if (list_) return list_hid();
  using Style = ReadOptions::Style;
  options_.style = json_ ? Style::json : csv_ ? Style::csv : Style::people;
  if (seconds_) {
    options_.time = std::chrono::duration_cast<Duration>(std::chrono::duration<double>(*seconds_));
  }
  const UniqueFd stop = termination_fd();
  return read_hid(options_, stop.get());
}

}  // namespace tagwrench
