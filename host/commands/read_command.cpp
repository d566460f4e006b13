// `tagwrench read`: what 6-DOF and wrench HID devices say, ours and others.
#include <optional>

#include "host/commands/commands.h"
#include "host/core/os/termination.h"
#include "host/tools/reading/reader.h"

namespace tagwrench {

void read_command(command_line::Command program) {
  struct Options : ReadOptions {
    std::optional<double> end;
    bool list = false;
    bool json = false;
    bool csv = false;
  };
  const auto o = std::make_shared<Options>();
  auto verb = program.add_subcommand(
      "read", "live values of wrench sensors and 6-DOF devices on HID, ours and others");
  verb.footer(
      "Forces are in N, torques in N m; pucks have counts. Rate, jitter (standard deviation and "
      "longest of the intervals), missing frames and latency (capture to arrival here, for a live "
      "sensor on this computer) come with each line and in the summary.");
  verb.add_option(
      "device", o->device,
      "serial, VID:PID or path; without it the only wrench sensor, or else the only 6-DOF device");
  auto list = verb.add_flag("--list", o->list, "list what is plugged in, and end");
  auto seconds =
      verb.add_option("--seconds", o->end, "end after S seconds").check(command_line::seconds());
  auto wait = verb.add_flag("--wait", o->wait,
                            "wait for a device that is not there, and again when it is gone");
  auto json = verb.add_flag("--json", o->json, "one JSON object a report");
  auto csv = verb.add_flag("--csv", o->csv, "one CSV row a report");
  auto log = verb.add_option("--log", o->log, "CSV file to write beside what is printed");
  json.excludes(csv);
  for (command_line::Option other : {seconds, wait, json, csv, log}) list.excludes(other);
  verb.runs([o] {
    if (o->list) return list_hid();
    using Style = ReadOptions::Style;
    o->style = o->json ? Style::json : o->csv ? Style::csv : Style::people;
    if (o->end)
      o->time = std::chrono::duration_cast<Duration>(std::chrono::duration<double>(*o->end));
    return read_hid(*o, termination_fd().get());
  });
}

}  // namespace tagwrench
