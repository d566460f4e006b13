// The emulated board behind a pseudo terminal, in real time: for tests with the whole program, and
// for trying tagwrench without a board.
//
//   tagwrench_emulated_board --port /tmp/board --cell 0=1.5 --cell 1=sine:0.5:0.3
//
// Orders come on standard input (board_orders.h). Standard output has one line per change of the
// light, `led TIME_S LEVEL`, times on CLOCK_MONOTONIC, levels from 0 to 1.
#include <poll.h>
#include <sys/prctl.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <fstream>
#include <optional>
#include <string>
#include <vector>

#include "host/core/command_line/command_line.h"
#include "host/core/config_error.h"
#include "host/core/os/termination.h"
#include "tests/firmware/board_orders.h"
#include "tests/firmware/other_version.h"

namespace tagwrench::emulator {
namespace {

using std::chrono::milliseconds;
using SteadyTime = std::chrono::steady_clock::time_point;

/// The emulator runs ahead in steps of this length; the host's bytes wait as long.
constexpr VirtualTime kStep = milliseconds(1);
constexpr VirtualTime kBehind = milliseconds(250);

void say(const std::string& line) {
  std::fprintf(stderr, "tagwrench_emulated_board: %s\n", line.c_str());
}

struct Options {
  std::string elf = TAGWRENCH_FIRMWARE_ELF;
  std::string port;
  std::vector<board::CellOption> cells;  ///< none: all four are wired
  std::string led_log;
  std::string eeprom;
  double seconds = 0;
  double clock_ppm = 0;
  bool stays_at_opening = false;
  bool any_baud = false;
  std::optional<std::uint8_t> protocol_major;
  bool quiet = false;
};

class RealTimeBoard {
 public:
  explicit RealTimeBoard(const Options& options)
      : options_(options),
        board_(options.elf, board_options(options)),
        port_(options.port),
        version_(options.protocol_major) {
    for (unsigned i = 0; i < kCells; ++i) board_.cell(i).bridge().noise_counts = 20;
    for (unsigned i = 0; i < 2; ++i) board_.set_adc(i, 1.0 + i);
    wire_cells();
    load_eeprom();
    if (!options.led_log.empty()) log_.open(options.led_log);
  }

  /// `signals` is readable when it is time to end.
  int run(int signals) {
    say("board on " + port_.name());
    start_ = std::chrono::steady_clock::now() - board_.now();
    while (options_.seconds <= 0 || board_.now() < seconds(options_.seconds)) {
      if (wait(signals)) break;
      listen();
      advance();
    }
    save_eeprom();
    return 0;
  }

 private:
  static BoardOptions board_options(const Options& options) {
    BoardOptions board;
    board.clock_ppm = options.clock_ppm;
    board.seed = static_cast<unsigned>(::getpid());
    return board;
  }
  static VirtualTime seconds(double s) {
    return std::chrono::duration_cast<VirtualTime>(std::chrono::duration<double>(s));
  }

  /// Until the next step is due, or orders or bytes come; true if it is time to end.
  bool wait(int signals) {
    const auto due = start_ + board_.now() + kStep - std::chrono::steady_clock::now();
    const auto left = std::max<std::int64_t>(
        0, std::chrono::duration_cast<std::chrono::nanoseconds>(due).count());
    pollfd fds[3] = {{signals, POLLIN, 0},
                     {listening_ ? STDIN_FILENO : -1, POLLIN, 0},
                     {port_.open() ? port_.fd() : -1, POLLIN, 0}};
    const timespec timeout{left / 1'000'000'000, left % 1'000'000'000};
    ::ppoll(fds, 3, &timeout, nullptr);
    if (fds[1].revents != 0) return fds[0].revents != 0 || take_orders();
    return fds[0].revents != 0;
  }

  bool take_orders() {
    char buffer[4096];
    const ssize_t count = ::read(STDIN_FILENO, buffer, sizeof buffer);
    if (count <= 0) {
      listening_ = false;
      return false;
    }
    typed_.append(buffer, static_cast<std::size_t>(count));
    for (std::size_t end; (end = typed_.find('\n')) != std::string::npos;) {
      const std::string line = typed_.substr(0, end);
      typed_.erase(0, end + 1);
      if (line == "quit") return true;
      if (const auto wrong = carry_out(line, board_, port_, start_)) say(*wrong);
    }
    return false;
  }

  void listen() {
    const bool open = port_.open();
    // An Arduino's reset line hangs on DTR, which opening the port raises.
    if (open && !was_open_ && !options_.stays_at_opening) board_.press_reset();
    was_open_ = open;
    const double baud = options_.any_baud ? 0 : port_.baud();
    if (baud > 0) board_.usart().set_baud(baud);
    same_baud_ = baud == 0 || std::abs(baud / kBoardBaud - 1) < 0.025;
    board_.write(port_.read());  // what a host wrote before it closed the port, too
  }

  void advance() {
    const auto wall = std::chrono::steady_clock::now() - start_;
    const VirtualTime behind = wall - board_.now();
    if (behind > kBehind) {
      say("this machine does not keep up: " + std::to_string(behind.count() / 1'000'000) +
          " ms behind; board time stands still for as long");
      start_ += behind;
    }
    const VirtualTime until = std::chrono::steady_clock::now() - start_;
    while (port_.plugged() && board_.now() < until) {
      board_.advance_to(std::min(until, board_.now() + kStep));
      send();
      write_light();
    }
    // Without the cable there is no power, and time goes on without the board.
    if (!port_.plugged()) {
      show_light(board_.now(), 0);
      start_ = std::chrono::steady_clock::now() - board_.now();
    }
  }

  void send() {
    std::vector<std::uint8_t> bytes;
    for (const SentByte& byte : board_.read())
      bytes.push_back(same_baud_ ? byte.value : static_cast<std::uint8_t>(byte.value * 37 + 11));
    bytes = version_.pass(bytes);
    if (was_open_) port_.write(bytes);
  }

  void write_light() {
    for (const LedChange& change : board_.led().all()) show_light(change.time, change.level);
    board_.led().forget();
  }

  void show_light(VirtualTime time, double level) {
    if (level == shown_) return;
    shown_ = level;
    const auto ns = (start_ + time).time_since_epoch().count();
    if (!options_.quiet) {
      std::printf("led %.6f %.4f\n", static_cast<double>(ns) * 1e-9, level);
      std::fflush(stdout);
    }
    if (log_) log_ << ns << ',' << level << std::endl;
  }

  void wire_cells() {
    if (options_.cells.empty()) return;
    for (unsigned i = 0; i < kCells; ++i) {
      const auto named = [i](const board::CellOption& cell) { return cell.channel == i; };
      if (std::none_of(options_.cells.begin(), options_.cells.end(), named))
        wire(board_, {i, {board::CellModel::none}});
    }
    for (const board::CellOption& cell : options_.cells) wire(board_, cell);
  }

  void load_eeprom() {
    std::ifstream file(options_.eeprom, std::ios::binary);
    const std::vector<std::uint8_t> bytes{std::istreambuf_iterator<char>(file), {}};
    if (bytes.empty() || bytes.size() > board_.core().eeprom().size()) return;
    board_.core().set_eeprom(0, bytes);
    board_.power_cycle();
  }

  void save_eeprom() {
    if (options_.eeprom.empty()) return;
    const std::vector<std::uint8_t> bytes = board_.core().eeprom();
    std::ofstream(options_.eeprom, std::ios::binary)
        .write(reinterpret_cast<const char*>(bytes.data()),
               static_cast<std::streamsize>(bytes.size()));
  }

  static constexpr double kBoardBaud = 500000;
  Options options_;
  EmulatedBoard board_;
  PtyLine port_;
  OtherVersion version_;
  std::ofstream log_;
  SteadyTime start_;  ///< wall time of virtual time zero
  std::string typed_;
  double shown_ = 0;
  bool listening_ = true;
  bool was_open_ = false;
  bool same_baud_ = true;
};

int run(int argc, char** argv) {
  Options options;
  command_line::Program app(
      "tagwrench's board, emulated: the flashable image on a pseudo terminal");
  app.add_option("--elf", options.elf, "image").capture_default_str();
  app.add_option("--port", options.port, "name to give the terminal, a symbolic link");
  std::vector<std::string> cells;
  app.add_option(
      "--cell", cells,
      std::string(board::kCellForms) + "; with any of them, a cell that is not named is not wired");
  app.add_option("--seconds", options.seconds, "then end");
  app.add_option("--led-log", options.led_log, "CSV file: t_ns,level");
  app.add_option("--eeprom", options.eeprom, "file that keeps the EEPROM");
  app.add_option("--clock-ppm", options.clock_ppm, "how much its crystal is fast");
  app.add_flag("--no-reset-at-opening", options.stays_at_opening,
               "unlike an Arduino, whose DTR resets it");
  app.add_flag("--any-baud", options.any_baud,
               "whatever rate the terminal is set to: the host's is not passed on");
  app.add_option("--protocol-major", options.protocol_major,
                 "the version of the protocol that it says it speaks");
  app.add_flag("--quiet", options.quiet, "no lines for the light");
  app.footer(help_on_orders());
  if (!app.parse(argc, argv, "; --help shows what there is")) return 0;
  for (const std::string& text : cells) {
    const auto cell = board::parse_cell(text);
    if (!cell) throw ConfigError("--cell " + text + " is none of " + board::kCellForms);
    options.cells.push_back(*cell);
  }
  // Before the port has its name, which whoever ends this program wants removed.
  const UniqueFd termination = termination_fd();
  return RealTimeBoard(options).run(termination.get());
}

}  // namespace
}  // namespace tagwrench::emulator

int main(int argc, char** argv) {
  ::prctl(PR_SET_PDEATHSIG, SIGTERM);
  std::signal(SIGPIPE, SIG_IGN);
  try {
    return tagwrench::emulator::run(argc, argv);
  } catch (const tagwrench::ConfigError& error) {
    tagwrench::emulator::say(error.what());
    return 2;
  } catch (const std::exception& error) {
    tagwrench::emulator::say(error.what());
    return 1;
  }
}
