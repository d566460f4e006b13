// `tagwrench board`: its options, and the verbs below it.
#include <fmt/format.h>

#include "host/commands/board/board.h"
#include "host/commands/commands.h"

namespace tagwrench {
namespace {

command_line::Check number(double least, double most, const char* what) {
  return command_line::number(least, most, fmt::format("{} from {:g} to {:g}", what, least, most),
                              "NUMBER");
}

constexpr const char* kLight =
    "off | LEVEL% | strobe PERIOD_US WIDTH_US [PHASE_US] | pattern [BIT_US [SEED]]; pulses begin "
    "where CLOCK_MONOTONIC is a multiple of the period plus the phase, then go by the board's "
    "clock";

void add_cells_file(command_line::Command verb, BoardOptions& o) {
  verb.add_option("--cells", o.cells_file,
                  "calibration of the load cells; without it the one kept for this board");
  verb.add_option("--input", o.cell_input, "amplifier's input and gain: a128, b32 or a64")
      .check(command_line::one_of({"a128", "b32", "a64"}));
  verb.add_option("--rate", o.cell_rate, "conversions per second: 10 or 80")
      .check(command_line::one_of({10, 80}));
}

void add_samples(command_line::Command verb, BoardOptions& o) {
  add_cells_file(verb, o);
  verb.add_option("--adc", o.adc_rate, "samples per second of the analogue inputs")
      .check(command_line::range(1, 200));
}

void add_seconds(command_line::Command verb, BoardOptions& o) {
  verb.add_option("--seconds", o.seconds, "end after S seconds")
      .check(number(1e-3, 1e9, "a number of seconds"));
}

void add_lines(command_line::Command verb, BoardOptions& o, const char* json) {
  verb.add_flag("--json", o.json, json);
  verb.add_option("--every", o.line_period, "seconds between lines without --json")
      .check(number(0.01, 3600, "a number of seconds"));
  add_seconds(verb, o);
}

}  // namespace

void board_command(command_line::Command program) {
  const auto shared = std::make_shared<BoardOptions>();
  BoardOptions& o = *shared;
  auto family =
      program.add_subcommand("board", "the board: light, load cells, buttons, shared clock");
  family.require_subcommand();
  const auto add = [&](const char* name, const char* what, int (*run)(const BoardOptions&)) {
    auto verb = family.add_subcommand(name, what);
    if (run != board_optoforce)
      verb.add_option("--port", o.port,
                      "path (best one of /dev/serial/by-id) or usb:VENDOR:PRODUCT[:SERIAL]; "
                      "without it the only USB serial port");
    verb.runs([shared, run] { return run(*shared); });
    return verb;
  };
  auto info = add("info", "who it is, what it can, how well its clock is known", board_info);
  auto watch = add("watch", "load cells, buttons and faults, live", board_watch);
  auto led = add("led", "light up until Ctrl-C", board_led);
  auto tare = add("tare", "take what the load cells show now as zero", board_tare);
  auto cell =
      add("calibrate-cell", "a load cell in newtons, from known masses", board_calibrate_cell);
  auto flash = add("flash", "put the firmware on an Arduino, by avrdude", board_flash);
  auto log = add("log", "all samples to a CSV file", board_log);
  auto optoforce =
      add("optoforce", "an OptoForce force-torque sensor on a serial port, live", board_optoforce);

  info.add_flag("--json", o.json, "as one JSON object");

  add_samples(watch, o);
  add_lines(watch, o, "one line of JSON per sample, event or fault");

  add_samples(log, o);
  add_seconds(log, o);
  log.add_option("--out", o.out, "CSV file; - is standard output").required();

  led.add_option("light", o.light, kLight).required().expected(1, 4);

  add_cells_file(tare, o);
  tare.add_option("--conversions", o.conversions, "to average").check(command_line::range(1, 1000));

  add_cells_file(cell, o);
  cell.add_option("--channel", o.channel, "of the load cell")
      .required()
      .check(command_line::range(0, static_cast<int>(link::kMaxChannels) - 1));
  cell.add_option("--mass", o.masses_kg,
                  "known masses in kg, two or more, in the order in which they will be put on; for "
                  "example 0,0.5")
      .required()
      .delimiter(',')
      .check(number(-1000, 1000, "a mass in kg"));
  cell.add_option("--gravity", o.gravity, "m/s^2, of this place")
      .check(number(9.7, 9.9, "an acceleration in m/s^2"));
  cell.add_option("--conversions", o.conversions, "to average per mass")
      .check(command_line::range(10, 10'000));

  flash.add_option("--board", o.model, "nano | nano-old (boot loader before 2018) | uno")
      .required()
      .check(command_line::one_of({"nano", "nano-old", "uno"}));
  flash.add_option("--image", o.image, "Intel HEX file; without it the one built here");
  flash.add_flag("--dry-run", o.dry_run, "print what would be run, and do nothing");

  optoforce.add_option("--port", o.port, "its serial port").required();
  optoforce
      .add_option("--counts-per-unit", o.counts_per_unit,
                  "from its data sheet: counts per N of Fx,Fy,Fz, then per N m of Tx,Ty,Tz where "
                  "it has them")
      .required()
      .delimiter(',');
  optoforce.add_option("--rate", o.force_rate, "Hz: 1000, 333, 100, 30 or 10");
  optoforce.add_option("--filter", o.force_filter, "Hz: 500, 150, 50, 15, 5, 1.5 or 0 for none");
  optoforce.add_flag("--zero", o.force_zero, "what it shows now is zero");
  add_lines(optoforce, o, "one line of JSON per sample");
}

}  // namespace tagwrench
