#include "host/verbs/read_command.h"

#include <csignal>

#include "host/os/termination.h"

namespace tagwrench {

ReadCommand::ReadCommand(CLI::App& app, const CLI::Validator& duration)
    : verb_(app.add_subcommand(
          "read", "live values of wrench sensors and 6-DOF devices on HID, ours and others")) {
  verb_->footer(
      "Forces are in N, torques in N m; pucks have counts. Rate, jitter (standard deviation and "
      "longest of the intervals), missing frames and latency (capture to arrival here, for a live "
      "sensor on this computer) come with each line and in the summary.");
  verb_->add_option("device", options_.device,
                    "serial, VID:PID or path; without it the only wrench sensor, or else the only "
                    "6-DOF device");
  auto* list = verb_->add_flag("--list", list_, "list what is plugged in, and end");
  auto* seconds = verb_->add_option("--seconds", seconds_, "end after S seconds")->check(duration);
  auto* wait = verb_->add_flag("--wait", options_.wait,
                               "wait for a device that is not there, and again when it is gone");
  auto* json = verb_->add_flag("--json", json_, "one JSON object a report");
  auto* csv = verb_->add_flag("--csv", csv_, "one CSV row a report");
  auto* log = verb_->add_option("--log", options_.log, "CSV file to write beside what is printed");
  json->excludes(csv);
  for (CLI::Option* other : {seconds, wait, json, csv, log}) list->excludes(other);
}

int ReadCommand::run() {
  std::signal(SIGPIPE, SIG_IGN);  // a closed pipe becomes an error code
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
