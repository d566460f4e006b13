// `tagwrench board flash`: avrdude writes the image and checks the chip's signature; the board's
// greeting then tells its version.
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <spawn.h>
#include <sys/wait.h>

#include <array>
#include <cerrno>
#include <charconv>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <string_view>

#include "host/app/board/board_loop.h"
#include "host/board/serial_port.h"
#include "host/commands/board/board.h"
#include "host/commands/commands.h"
#include "host/core/config_error.h"
#include "host/core/log.h"
#include "host/output/line_outputs.h"

extern char** environ;

namespace tagwrench {
namespace {

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

enum class HexRecord : std::uint8_t { wrong, data, end };

/// One line of Intel HEX: ":", then length, address (2), type, data and checksum in hex digits; all
/// bytes together are 0 modulo 256 (Intel, "Hexadecimal Object File Format Specification", 1988).
HexRecord hex_record(std::string_view line) {
  if (line.ends_with('\r')) line.remove_suffix(1);
  if (line.size() < 11 || line.size() % 2 == 0 || line[0] != ':') return HexRecord::wrong;
  unsigned sum = 0;
  std::array<unsigned, 4> head{};
  for (std::size_t i = 0; i < line.size() / 2; ++i) {
    unsigned byte = 0;
    const char* digits = line.data() + 1 + 2 * i;
    const auto [end, error] = std::from_chars(digits, digits + 2, byte, 16);
    if (error != std::errc{} || end != digits + 2) return HexRecord::wrong;
    if (i < head.size()) head[i] = byte;
    sum += byte;
  }
  if (sum % 256 != 0 || line.size() != 11 + 2 * head[0]) return HexRecord::wrong;
  return head[3] == 1 ? HexRecord::end : HexRecord::data;
}

/// Half an image would be worse than none.
void check_image(const std::string& path) {
  std::error_code error;
  if (!fs::is_regular_file(path, error))
    throw ConfigError("{}: there is no such file; give --image FILE.hex", path);
  std::ifstream in(path);
  HexRecord last = HexRecord::wrong;
  if (fs::file_size(path, error) <= kMaxImageBytes) {
    for (std::string line; std::getline(in, line);) {
      last = hex_record(line);
      if (last != HexRecord::data) break;
    }
  }
  if (last != HexRecord::end)
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
  while (::waitpid(child, &status, 0) < 0 && errno == EINTR) {
  }
  return WIFEXITED(status) ? WEXITSTATUS(status) : 128;
}

}  // namespace

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

}  // namespace tagwrench
