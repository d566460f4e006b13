#include "host/app/run.h"

#include <fmt/format.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cctype>
#include <cstdlib>
#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "host/app/input.h"
#include "host/app/instrument.h"
#include "host/app/run_input.h"
#include "host/core/config_error.h"
#include "host/core/log.h"
#include "host/core/os/termination.h"
#include "host/core/os/uninterrupted.h"
#include "host/core/os/user_folders.h"
#include "host/web/bridge/recording_folder.h"
#include "host/web/server/web_options.h"

namespace tagwrench {
namespace {

namespace fs = std::filesystem;

/// A board lives in real time.
void check_board(const RunOptions& options, std::span<const OutputSpec> outputs) {
  const OutputSpec* reference = find_output(outputs, OutputKind::reference);
  if (options.board.empty()) {
    if (!options.cells.empty())
      throw ConfigError("--cells: the load cells are a board's; name its port with --board");
    if (reference != nullptr) {
      throw ConfigError("--output {}: the load cells are a board's; name its port with --board",
                        reference->text());
    }
    return;
  }
  if (options.fast)
    throw ConfigError("--fast: a board has its own time; leave it out, or leave out --board");
  if (!options.source.empty() && parse_source(options.source).row->own_time) {
    throw ConfigError(
        "--source {}: these pictures are of another time than what the board says now; leave out "
        "--board",
        options.source);
  }
}

void check_name(const std::string& name) {
  const bool usable = !name.empty() && name.size() <= 32 &&
                      std::all_of(name.begin(), name.end(), [](unsigned char c) {
                        return std::isalnum(c) != 0 || c == '-' || c == '_';
                      });
  if (!usable)
    throw ConfigError("--name {}: must be 1 to 32 letters, digits, - and _; choose another", name);
}

/// In the browser of the desktop, where there is one; the shell leaves it to itself, and Ctrl-C in
/// our terminal too.
void open_in_browser(const std::string& url) {
  if (std::getenv("DISPLAY") == nullptr && std::getenv("WAYLAND_DISPLAY") == nullptr) return;
  std::string shell = "sh", option = "-c", command = "xdg-open \"$0\" >/dev/null 2>&1 </dev/null &",
              address = url;
  char* const arguments[] = {shell.data(), option.data(), command.data(), address.data(), nullptr};
  posix_spawnattr_t own_session;
  ::posix_spawnattr_init(&own_session);
  ::posix_spawnattr_setflags(&own_session, POSIX_SPAWN_SETSID);
  pid_t pid = 0;
  if (::posix_spawn(&pid, "/bin/sh", nullptr, &own_session, arguments, environ) == 0)
    uninterrupted([&] { return ::waitpid(pid, nullptr, 0); });
  ::posix_spawnattr_destroy(&own_session);
}

/// Whether there are pages. Throws ConfigError where options are theirs, and they are not there.
bool has_web(const RunOptions& options, std::span<const OutputSpec> outputs) {
  if (find_output(outputs, OutputKind::pages) != nullptr || options.web.open) return true;
  if (!options.web.token_file.empty())
    throw ConfigError("--web-token: is for pages; add --output web:ADDRESS:PORT");
  if (!options.web.recordings.empty())
    throw ConfigError("--recordings: is for pages; add --output web");
  return false;
}

/// Binds, serves, and says where.
std::unique_ptr<WebBridge> open_web(const RunOptions& options, std::span<const OutputSpec> outputs,
                                    const UniqueFd& stop) {
  WebBridgeOptions web;
  const OutputSpec* spec = find_output(outputs, OutputKind::pages);
  web.server = parse_web("--output web", spec == nullptr ? "" : spec->argument);
  web.server.pages = options.web.pages.empty() ? built_pages() : fs::path(options.web.pages);
  bool token_made = false;
  if (!options.web.token_file.empty()) {
    const WebToken token = web_token(options.web.token_file);
    web.server.token = token.text;
    token_made = token.made;
  }
  web.recordings = options.web.recordings.empty() ? usual_recording_folder()
                                                  : fs::absolute(options.web.recordings);
  if (const std::string folder = config_folder(); !folder.empty())
    web.own_profiles = fs::path(folder) / "profiles";
  auto bridge = std::make_unique<WebBridge>(web, stop.get());
  log_info("pages: {}{}", token_made ? bridge->url_with_token() : bridge->url(),
           web.server.token.empty() || token_made
               ? ""
               : fmt::format("#token=... (the token is in {})", options.web.token_file));
  bridge->start();
  if (options.web.open) open_in_browser(bridge->url_with_token());
  return bridge;
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
