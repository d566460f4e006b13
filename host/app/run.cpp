#include "host/app/run.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "host/app/instrument.h"
#include "host/app/run_input.h"
#include "host/app/run_web.h"
#include "host/app/sources.h"
#include "host/core/config_error.h"
#include "host/core/log.h"
#include "host/core/os/termination.h"

namespace tagwrench {
namespace {

/// A board lives in real time.
void check_board(const RunOptions& options, std::span<const OutputSpec> outputs) {
  const OutputSpec* reference = find_output(outputs, OutputKind::reference);
  if (options.board.empty()) {
    if (!options.cells.empty())
      throw ConfigError("--cells: the load cells are a board's; name its port with --board");
    if (reference != nullptr) {
      throw ConfigError(
          fmt::format("--output {}: the load cells are a board's; name its port with --board",
                      reference->text()));
    }
    return;
  }
  if (options.fast)
    throw ConfigError("--fast: a board has its own time; leave it out, or leave out --board");
  if (!options.source.empty() && parse_source(options.source).row->own_time) {
    throw ConfigError(fmt::format(
        "--source {}: these pictures are of another time than what the board says now; leave out "
        "--board",
        options.source));
  }
}

void check_name(const std::string& name) {
  const bool usable = !name.empty() && name.size() <= 32 &&
                      std::all_of(name.begin(), name.end(), [](unsigned char c) {
                        return std::isalnum(c) != 0 || c == '-' || c == '_';
                      });
  if (!usable)
    throw ConfigError(
        fmt::format("--name {}: must be 1 to 32 letters, digits, - and _; choose another", name));
}

/// What goes on while there is no run.
std::vector<Output*> beside(RunSession& session) {
  session.outputs.close_for_job();
  std::vector<Output*> all = session.outputs.all();
  if (session.watch) all.push_back(session.watch.get());
  return all;
}

}  // namespace

int run(const RunOptions& given) {
  const UniqueFd caught = termination_fd();  // what comes while it is set up ends it in order, too
  const std::vector<OutputSpec> asked = parse_outputs(given.outputs);  // refused before anything
  check_board(given, asked);                                           // is opened or lit
  check_name(given.name);
  const bool pages = has_web(given, asked);
  RunSession session{with_own_sensor(given), asked};
  if (session.options.record) check_recording(*session.options.record);
  const UniqueFd stop = termination_fd();
  if (pages) session.pages = open_web(session.options, asked, stop);
  // One run after the other, as pages want the camera and give it back.
  for (bool first = true;; first = false) {
    std::string failure;
    try {
      const std::unique_ptr<Instrument> instrument = Instrument::build(session);
      if (!instrument) return 0;
      const RunReport report = instrument->pipeline().run(instrument->limits());
      const bool lent = report.end == RunReport::End::interrupted && !termination_requested();
      if (!lent || !pages) return instrument->end(report);
      instrument->lend(report);
    } catch (const ConfigError& e) {
      if (first) throw;
      failure = e.what();
      log_info(failure);
    }
    const bool again = failure.empty() ? session.pages->lend_camera(beside(session))
                                       : session.pages->wait_after(failure, beside(session));
    if (!again) return 0;
  }
}

}  // namespace tagwrench
