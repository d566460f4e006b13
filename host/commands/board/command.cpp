#include "host/commands/board/command.h"

#include <fmt/format.h>

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

}  // namespace

BoardCommand::BoardCommand(command_line::Command program)
    : verb_(program.add_subcommand("board", "the board: light, load cells, buttons, shared clock")),
      info_(add("info", "who it is, what it can, how well its clock is known")),
      watch_(add("watch", "load cells, buttons and faults, live")),
      led_(add("led", "light up until Ctrl-C")),
      tare_(add("tare", "take what the load cells show now as zero")),
      calibrate_cell_(add("calibrate-cell", "a load cell in newtons, from known masses")),
      flash_(add("flash", "put the firmware on an Arduino, by avrdude")),
      log_(add("log", "all samples to a CSV file")),
      optoforce_(verb_.add_subcommand("optoforce",
                                      "an OptoForce force-torque sensor on a serial port, live")) {
  verb_.require_subcommand();

  info_.add_flag("--json", options_.json, "as one JSON object");

  add_samples(watch_);
  add_lines(watch_, "one line of JSON per sample, event or fault");

  add_samples(log_);
  add_seconds(log_);
  log_.add_option("--out", options_.out, "CSV file; - is standard output").required();

  led_.add_option("light", options_.light, kLight).required().expected(1, 4);

  add_cells_file(tare_);
  tare_.add_option("--conversions", options_.conversions, "to average")
      .check(command_line::range(1, 1000));

  add_cells_file(calibrate_cell_);
  calibrate_cell_.add_option("--channel", options_.channel, "of the load cell")
      .required()
      .check(command_line::range(0, static_cast<int>(link::kMaxChannels) - 1));
  calibrate_cell_
      .add_option("--mass", options_.masses_kg,
                  "known masses in kg, two or more, in the order in which they will be put on; for "
                  "example 0,0.5")
      .required()
      .delimiter(',')
      .check(number(-1000, 1000, "a mass in kg"));
  calibrate_cell_.add_option("--gravity", options_.gravity, "m/s^2, of this place")
      .check(number(9.7, 9.9, "an acceleration in m/s^2"));
  calibrate_cell_.add_option("--conversions", options_.conversions, "to average per mass")
      .check(command_line::range(10, 10'000));

  flash_.add_option("--board", options_.model, "nano | nano-old (boot loader before 2018) | uno")
      .required()
      .check(command_line::one_of({"nano", "nano-old", "uno"}));
  flash_.add_option("--image", options_.image, "Intel HEX file; without it the one built here");
  flash_.add_flag("--dry-run", options_.dry_run, "print what would be run, and do nothing");

  add_optoforce();
}

void BoardCommand::add_optoforce() {
  optoforce_.add_option("--port", options_.port, "its serial port").required();
  optoforce_
      .add_option(
          "--counts-per-unit", options_.counts_per_unit,
          "from its data sheet: counts per N of Fx,Fy,Fz, then per N m of Tx,Ty,Tz where it "
          "has them")
      .required()
      .delimiter(',');
  optoforce_.add_option("--rate", options_.force_rate, "Hz: 1000, 333, 100, 30 or 10");
  optoforce_.add_option("--filter", options_.force_filter,
                        "Hz: 500, 150, 50, 15, 5, 1.5 or 0 for none");
  optoforce_.add_flag("--zero", options_.force_zero, "what it shows now is zero");
  add_lines(optoforce_, "one line of JSON per sample");
}

void BoardCommand::add_lines(command_line::Command verb, const char* json) {
  verb.add_flag("--json", options_.json, json);
  verb.add_option("--every", options_.line_period, "seconds between lines without --json")
      .check(number(0.01, 3600, "a number of seconds"));
  add_seconds(verb);
}

void BoardCommand::add_seconds(command_line::Command verb) {
  verb.add_option("--seconds", options_.seconds, "end after S seconds")
      .check(number(1e-3, 1e9, "a number of seconds"));
}

command_line::Command BoardCommand::add(const char* name, const char* what) {
  command_line::Command verb = verb_.add_subcommand(name, what);
  verb.add_option("--port", options_.port,
                  "path (best one of /dev/serial/by-id) or usb:VENDOR:PRODUCT[:SERIAL]; without "
                  "it the only USB serial port");
  return verb;
}

void BoardCommand::add_cells_file(command_line::Command verb) {
  verb.add_option("--cells", options_.cells_file,
                  "calibration of the load cells; without it the one kept for this board");
  verb.add_option("--input", options_.cell_input, "amplifier's input and gain: a128, b32 or a64")
      .check(command_line::one_of({"a128", "b32", "a64"}));
  verb.add_option("--rate", options_.cell_rate, "conversions per second: 10 or 80")
      .check(command_line::one_of({10, 80}));
}

void BoardCommand::add_samples(command_line::Command verb) {
  add_cells_file(verb);
  verb.add_option("--adc", options_.adc_rate, "samples per second of the analogue inputs")
      .check(command_line::range(1, 200));
}

int BoardCommand::run() const {
  if (info_.parsed()) return board_info(options_);
  if (watch_.parsed()) return board_watch(options_);
  if (log_.parsed()) return board_log(options_);
  if (led_.parsed()) return board_led(options_);
  if (tare_.parsed()) return board_tare(options_);
  if (calibrate_cell_.parsed()) return board_calibrate_cell(options_);
  if (optoforce_.parsed()) return board_optoforce(options_);
  return board_flash(options_);
}

}  // namespace tagwrench
