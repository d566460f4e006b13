// tagwrench_board_pc: the firmware's application as a process on a pseudo-terminal.
#include <CLI/CLI.hpp>
#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <string>
#include <vector>

#include "firmware/app/app.h"
#include "firmware/board/pc/pc_board.h"

namespace {

volatile std::sig_atomic_t stopped = 0;

/// "N=FORCE", "N=sine", "N=none" or "N=stuck". Empty, or what is wrong.
std::string wire_cell(const std::string& text) {
  using tagwrench::board::Cell;
  using tagwrench::board::CellModel;
  unsigned channel = 0;
  char what[32] = "";
  if (std::sscanf(text.c_str(), "%u=%31s", &channel, what) != 2 ||
      channel >= tagwrench::link::kMostCells)
    return text + " is not N=FORCE|sine|none|stuck with N from 0 to 3";
  Cell cell{CellModel::constant, 0};
  char* end = what;
  if (std::strcmp(what, "sine") == 0) {
    cell.model = CellModel::sine;
  } else if (std::strcmp(what, "none") == 0) {
    cell.model = CellModel::none;
  } else if (std::strcmp(what, "stuck") == 0) {
    cell.model = CellModel::stuck;
  } else if (cell.force_n = std::strtod(what, &end); *end != '\0') {
    return text + ": the force is a number in newtons";
  }
  tagwrench::board::wire_cell(channel, cell);
  return "";
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App options{"The board's firmware as a process, on a pseudo-terminal"};
  std::string port;
  std::vector<std::string> cells;
  options.add_option("--port", port, "symbolic link to make to the pseudo-terminal")->required();
  options
      .add_option("--cell", cells, "N=FORCE in newtons, N=sine, N=none or N=stuck; default sine")
      ->each([](const std::string& text) {
        const std::string wrong = wire_cell(text);
        if (!wrong.empty()) throw CLI::ValidationError(wrong);
      });
  try {
    options.parse(argc, argv);
  } catch (const CLI::Success& help) {
    return options.exit(help);
  } catch (const CLI::ParseError& error) {
    std::fprintf(stderr, "tagwrench_board_pc: %s\n", error.what());
    return 2;
  }
  std::signal(SIGTERM, [](int) { stopped = 1; });
  std::signal(SIGINT, [](int) { stopped = 1; });
  if (!tagwrench::board::open_port(port)) {
    std::fprintf(stderr, "tagwrench_board_pc: cannot make %s: %s\n", port.c_str(),
                 std::strerror(errno));
    return 2;
  }
  tagwrench::firmware::App app(tagwrench::board::now_us());
  while (stopped == 0) {
    tagwrench::board::wait();
    app.poll(tagwrench::board::now_us());
  }
  std::remove(port.c_str());
  return 0;
}
