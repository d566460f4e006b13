// tagwrench_board_pc: the firmware's application as a process on a pseudo-terminal.
#include <csignal>
#include <cstdio>
#include <string>
#include <vector>

#include "firmware/app/app.h"
#include "firmware/board/pc/pc_board.h"
#include "host/core/command_line/command_line.h"
#include "host/core/config_error.h"

namespace {

volatile std::sig_atomic_t stopped = 0;

}  // namespace

int main(int argc, char** argv) {
  using tagwrench::board::kCellForms;
  tagwrench::command_line::Program options(
      "The board's firmware as a process, on a pseudo-terminal");
  std::string port;
  std::vector<std::string> cells;
  for (unsigned i = 0; i < tagwrench::link::kMaxCells; ++i)
    tagwrench::board::wire_cell(i, tagwrench::board::slow_sine(i));
  options.add_option("--port", port, "symbolic link to make to the pseudo-terminal").required();
  options.add_option("--cell", cells, std::string(kCellForms) + "; cells that are not named: sine");
  try {
    if (!options.parse(argc, argv, "")) return 0;
  } catch (const tagwrench::ConfigError& error) {
    std::fprintf(stderr, "tagwrench_board_pc: %s\n", error.what());
    return 2;
  }
  for (const std::string& text : cells) {
    const auto cell = tagwrench::board::parse_cell(text);
    if (!cell) {
      std::fprintf(stderr, "tagwrench_board_pc: --cell %s is none of %s\n", text.c_str(),
                   kCellForms);
      return 2;
    }
    tagwrench::board::wire_cell(cell->channel, cell->cell);
  }
  std::signal(SIGTERM, [](int) { stopped = 1; });
  std::signal(SIGINT, [](int) { stopped = 1; });
  if (const std::string wrong = tagwrench::board::open_port(port); !wrong.empty()) {
    std::fprintf(stderr, "tagwrench_board_pc: %s\n", wrong.c_str());
    return 2;
  }
  tagwrench::firmware::App app(tagwrench::board::now_us());
  while (stopped == 0) {
    tagwrench::board::wait();
    app.poll(tagwrench::board::now_us());
  }
  tagwrench::board::close_port();
  return 0;
}
