// `tagwrench board`: its options, and of the verbs below it `info`, `led` and `flash`: avrdude
// writes the image and checks the chip's signature; the board's greeting then tells its version.

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <spawn.h>
#include <sys/wait.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "host/app/board/board_loop.h"
#include "host/board/cell_calibration.h"
#include "host/board/hex_image.h"
#include "host/board/serial_port.h"
#include "host/commands/board/board.h"
#include "host/commands/commands.h"
#include "host/core/command_line/command_line.h"
#include "host/core/config_error.h"
#include "host/core/json/json_text.h"
#include "host/core/log.h"
#include "host/core/os/text_file.h"
#include "host/core/os/uninterrupted.h"
#include "host/core/parse.h"
#include "host/output/line_outputs.h"

extern char** environ;

// Not fuzzed: fuzz.tables has the image.

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

using link::BoardSession;

double us(Duration d) { return std::chrono::duration<double, std::micro>(d).count(); }

std::string for_people(const BoardSession& session, const std::string& port) {
  const link::Hello& hello = session.hello();
  const link::Capabilities& can = session.capabilities();
  const link::Status& status = session.status();
  const link::ClockReport clock = session.clock().report();
  const link::SessionCounters counters = session.counters();
  std::string out;
  const auto line = [&out](const char* what, const std::string& value) {
    out += fmt::format("{:<12}{}\n", what, value);
  };
  const std::string id = link::id_text(hello.unique_id);
  line("board", fmt::format("{}, firmware {}, protocol {}.{}", hello.board, hello.firmware,
                            hello.protocol_major, hello.protocol_minor));
  line("id", id.empty() ? "none" : id);
  line("port", port);
  line("started", fmt::format("by {} (boot {:08x})",
                              link::reset_cause_name(static_cast<std::uint32_t>(hello.reset_cause)),
                              hello.boot_id));
  line("inputs", fmt::format("{} load cells, {} analogue ({} bits), {} buttons", can.cells,
                             can.adc_channels, can.adc_bits, can.buttons));
  line("LED",
       fmt::format("{} levels; {:.0f} % for ever, full for {:.0f} s from cold", can.led_levels,
                   can.led_sustained_permille / 10.0, can.led_full_time_ms / 1000.0));
  line("strobe",
       fmt::format("pulses of {} to {} us, one every {} to {} us", can.strobe_width_min_us,
                   can.strobe_width_max_us, can.strobe_period_min_us, can.strobe_period_max_us));
  line("clock", fmt::format("{:+.1f} +- {:.1f} ppm to this host, in steps of {} ns; times are good "
                            "to {:.0f} us, {:.0f} us of it common to all{}",
                            clock.skew_ppm, clock.skew_sigma_ppm, can.time_step_ns,
                            std::hypot(us(clock.random_sigma), us(clock.asymmetry_sigma)),
                            us(clock.asymmetry_sigma), clock.converged ? "" : "; not settled yet"));
  if (session.has_status()) {
    line("supply",
         can.measures_supply ? fmt::format("{:.2f} V", status.supply_mv / 1000.0) : "not measured");
    if (can.measures_temperature)
      line("temperature", fmt::format("{:.1f} C", status.temperature_centidegree / 100.0));
    line("loop", fmt::format("longest {} us; {} bytes of stack never used", status.longest_loop_us,
                             status.stack_free_bytes));
    line("board lost", fmt::format("{} bad frames, {} bytes, {} reports", status.bad_frames,
                                   status.overruns, status.dropped_reports));
  }
  line("host lost", fmt::format("{} bad frames, {} frames missing", counters.damaged_frames,
                                counters.lost_frames));
  return out;
}

std::string as_json(const BoardSession& session, const std::string& port) {
  const link::Hello& hello = session.hello();
  const link::Capabilities& can = session.capabilities();
  const link::Status& status = session.status();
  const link::ClockReport clock = session.clock().report();
  const link::SessionCounters counters = session.counters();
  const nlohmann::ordered_json root{
      {"board", hello.board},
      {"firmware", hello.firmware},
      {"protocol", fmt::format("{}.{}", hello.protocol_major, hello.protocol_minor)},
      {"id", link::id_text(hello.unique_id)},
      {"port", port},
      {"boot_id", hello.boot_id},
      {"reset_cause", link::reset_cause_name(static_cast<std::uint32_t>(hello.reset_cause))},
      {"cells", can.cells},
      {"adc_channels", can.adc_channels},
      {"adc_bits", can.adc_bits},
      {"buttons", can.buttons},
      {"led_levels", can.led_levels},
      {"led_sustained_permille", can.led_sustained_permille},
      {"led_full_time_ms", can.led_full_time_ms},
      {"skew_ppm", clock.skew_ppm},
      {"skew_sigma_ppm", clock.skew_sigma_ppm},
      {"time_sigma_us", std::hypot(us(clock.random_sigma), us(clock.asymmetry_sigma))},
      {"clock_converged", clock.converged},
      {"supply_mv", status.supply_mv},
      {"bad_frames", status.bad_frames},
      {"overruns", status.overruns},
      {"dropped_reports", status.dropped_reports},
      {"stack_free_bytes", status.stack_free_bytes},
      {"longest_loop_us", status.longest_loop_us},
      {"host_damaged_frames", counters.damaged_frames},
      {"host_lost_frames", counters.lost_frames},
  };
  // The board's strings are bytes of a stranger; what is no UTF-8 is replaced.
  return dump_json(root) + "\n";
}

using std::chrono::milliseconds;

[[noreturn]] void not_a_light(const BoardOptions& options) {
  std::string words;
  for (const std::string& word : options.light) words += (words.empty() ? "" : " ") + word;
  throw ConfigError(
      "board led '{}': not a light; use off, LEVEL% (0 to 100), strobe PERIOD_US WIDTH_US "
      "[PHASE_US] or pattern [BIT_US [SEED]]",
      words);
}

struct Light {
  link::Led led{};
  double phase_us = 0;  ///< of a strobe
};

Light light_of(const BoardOptions& options) {
  const std::vector<std::string>& words = options.light;
  const auto number = [&](const std::string& text, double least, double most) {
    const std::optional<double> value = command_line::to_number(text);
    if (!value || !(*value >= least && *value <= most)) not_a_light(options);
    return *value;
  };
  Light out;
  const std::size_t count = words.size();
  if (words[0] == "off" && count == 1) return out;
  if (words[0] == "strobe" && (count == 3 || count == 4)) {
    out.led.mode = link::LedMode::strobe;
    out.led.period_us = static_cast<std::uint32_t>(number(words[1], 1, 60e6));
    out.led.width_us = static_cast<std::uint16_t>(number(words[2], 1, 65535));
    if (count == 4) out.phase_us = number(words[3], -60e6, 60e6);
    return out;
  }
  if (words[0] == "pattern" && count <= 3) {
    out.led.mode = link::LedMode::pattern;
    out.led.period_us = static_cast<std::uint32_t>(count > 1 ? number(words[1], 1, 60e6) : 7000);
    out.led.pattern_seed = static_cast<std::uint16_t>(count > 2 ? number(words[2], 1, 32767) : 1);
    return out;
  }
  if (count != 1 || words[0].back() != '%') not_a_light(options);
  const double percent = number(words[0].substr(0, words[0].size() - 1), 0, 100);
  out.led.mode = link::LedMode::steady;
  out.led.level_permille = static_cast<std::uint16_t>(std::lround(percent * 10));
  return out;
}

/// Throws ConfigError for pulses that this board cannot do.
void check_limits(const link::Led& led, const link::Capabilities& can) {
  if (led.period_us == 0 || can.strobe_period_max_us == 0) return;
  const auto check = [](const char* what, std::uint32_t value, std::uint32_t least,
                        std::uint32_t most, const std::string& condition = {}) {
    if (value < least || value > most)
      throw ConfigError("{} {} us: this board does {} to {} us{}", what, value, least, most,
                        condition);
  };
  const bool strobe = led.mode == link::LedMode::strobe;
  check(strobe ? "period" : "bit", led.period_us, can.strobe_period_min_us,
        can.strobe_period_max_us);
  if (!strobe) return;
  check("width", led.width_us, can.strobe_width_min_us, can.strobe_width_max_us);
  // Dark between two pulses for as long as a pulse lasts at least.
  const std::uint32_t dark = std::min<std::uint32_t>(can.strobe_width_min_us, led.period_us);
  check("width", led.width_us, can.strobe_width_min_us, led.period_us - dark,
        fmt::format(" with a period of {} us", led.period_us));
}

/// The next host time at which a pulse is due, as board time.
std::uint32_t start_of(const Light& light, const link::ClockSync& clock) {
  const TimePoint soon = std::chrono::steady_clock::now() + milliseconds(100);
  const std::int64_t soon_ns = soon.time_since_epoch().count();
  const std::int64_t period_ns = std::int64_t{light.led.period_us} * 1000;
  const std::int64_t phase_ns = std::llround(light.phase_us * 1000);
  const std::int64_t past = ((soon_ns - phase_ns) % period_ns + period_ns) % period_ns;
  return clock.to_board(soon + Duration(period_ns - past));
}

namespace fs = std::filesystem;

constexpr const char* kImageName = "tagwrench-atmega328p.hex";
constexpr std::uintmax_t kMaxImageBytes = 128 * 1024;  ///< 32 KB of flash as Intel HEX

/// Beside this program as it was built, or as it was installed; or in the clone where we are.
std::string find_image() {
  std::error_code error;
  const fs::path program = fs::read_symlink("/proc/self/exe", error);
  const fs::path above = program.parent_path().parent_path();
  const fs::path folders[] = {above / "firmware", above / "share" / "tagwrench",
                              fs::current_path(error) / "build" / "firmware"};
  std::string looked;
  for (const fs::path& folder : folders) {
    if (fs::exists(folder / kImageName, error)) return (folder / kImageName).string();
    looked += (looked.empty() ? "" : ", ") + folder.string();
  }
  throw ConfigError(
      "board flash: no {} in {}; run `./run firmware` in the clone, or give --image FILE",
      kImageName, looked);
}

void check_image(const std::string& path) {
  std::error_code error;
  if (!fs::is_regular_file(path, error))
    throw ConfigError("{}: there is no such file; give --image FILE.hex", path);
  if (!is_whole_hex_image(text_of_file(path, kMaxImageBytes).value_or("")))
    throw ConfigError(
        "{}: not an Intel HEX file of an ATmega328P, or not a whole one; give --image FILE.hex",
        path);
}

std::string flash_port(const BoardOptions& options) {
  if (const auto identity = link::parse_usb_identity(options.port))
    return options.dry_run ? "PORT" : link::find_usb_port(*identity);
  if (!options.port.empty()) return options.port;
  if (!options.dry_run) return link::only_port();
  const std::vector<std::string> ports = link::stable_ports();
  return ports.size() == 1 ? ports.front() : "PORT";
}

/// The boot loader's speeds, as the Arduino core's boards.txt has them.
std::vector<std::string> avrdude_arguments(const BoardOptions& options, const std::string& port,
                                           const std::string& image) {
  return {"avrdude",
          "-p",
          "m328p",
          "-c",
          "arduino",
          "-b",
          options.model == "nano-old" ? "57600" : "115200",
          "-P",
          port,
          "-D",
          "-U",
          fmt::format("flash:w:{}:i", image)};
}

/// Exit status of the program, its messages on standard error.
int run_program(std::vector<std::string> arguments) {
  std::vector<char*> argv;
  for (std::string& a : arguments) argv.push_back(a.data());
  argv.push_back(nullptr);
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_adddup2(&actions, 2, 1);  // standard output is for data
  pid_t child = -1;
  const int failed = ::posix_spawnp(&child, argv[0], &actions, nullptr, argv.data(), environ);
  posix_spawn_file_actions_destroy(&actions);
  if (failed == ENOENT)
    throw ConfigError("board flash: avrdude is not installed; `sudo apt install avrdude`");
  if (failed != 0)
    throw ConfigError("board flash: avrdude cannot be started: {}; try again",
                      std::strerror(failed));
  int status = 0;
  uninterrupted([&] { return ::waitpid(child, &status, 0); });
  return WIFEXITED(status) ? WEXITSTATUS(status) : 128;
}

int board_info(const BoardOptions& options) {
  BoardLoop loop(options.port, session_options(options));
  if (!loop.settle()) return 0;
  print_data(options.json ? as_json(loop.session(), loop.link().port())
                          : for_people(loop.session(), loop.link().port()));
  return 0;
}

int board_led(const BoardOptions& options) {
  Light light = light_of(options);
  BoardLoop loop(options.port, session_options(options));
  if (!loop.settle()) return 0;
  if (loop.session().has_capabilities()) check_limits(light.led, loop.session().capabilities());
  if (light.led.period_us > 0) light.led.start_us = start_of(light, loop.session().clock());
  loop.session().set_led(light.led);
  loop.link().send();

  const bool stays = light.led.mode != link::LedMode::off;
  bool told = false;
  const TimePoint begin = std::chrono::steady_clock::now();
  while (loop.turn(begin + (stays ? std::chrono::hours(24 * 365) : milliseconds(300)))) {
    if (loop.led_refused()) return 2;
    if (!stays && std::chrono::steady_clock::now() - begin > milliseconds(300)) return 0;
    if (stays && !told && loop.session().led_accepted()) {
      told = true;
      log_info("the light stays until Ctrl-C");
    }
  }
  loop.session().set_led(link::Led{});
  loop.link().send();
  return 0;
}

int board_flash(const BoardOptions& options) {
  const std::string image = options.image.empty() ? find_image() : options.image;
  check_image(image);
  const std::string port = flash_port(options);
  const std::vector<std::string> arguments = avrdude_arguments(options, port, image);
  if (options.dry_run) {
    print_data(fmt::format("{}\n", fmt::join(arguments, " ")));
    return 0;
  }
  { const link::SerialPort free(port, link::kBaud); }  // or it says what is the matter
  log_info("running {}", fmt::join(arguments, " "));
  if (const int status = run_program(arguments); status != 0) {
    log_info(
        "board flash: avrdude failed ({}); is it a {} with an ATmega328P? A Nano with the old boot "
        "loader is --board nano-old",
        status, options.model);
    return 1;
  }
  BoardLoop loop(port, session_options(options));
  if (!loop.connect()) return 0;
  const link::Hello& hello = loop.session().hello();
  if (options.image.empty() && std::string(hello.firmware) != TAGWRENCH_VERSION) {
    log_info(
        "board flash: the board says firmware {} after {} was written; check the image and try "
        "again",
        hello.firmware, TAGWRENCH_VERSION);
    return 1;
  }
  log_info("the board answers: {}, firmware {}, protocol {}.{}", hello.board, hello.firmware,
           hello.protocol_major, hello.protocol_minor);
  return 0;
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
