// `tagwrench spnav`: the daemon of the spnav socket, by hand or as a service.
#include <fmt/format.h>
#include <sys/prctl.h>

#include <chrono>
#include <csignal>
#include <memory>
#include <utility>

#include "host/commands/commands.h"
#include "host/core/config_error.h"
#include "host/core/log.h"
#include "host/core/os/termination.h"
#include "host/output/spnav_daemon.h"
#include "host/output/watchdog.h"

namespace tagwrench {
namespace {

/// How long a daemon that a bridge has started waits for the next bridge or program.
constexpr Duration kIdle = std::chrono::minutes(1);

SpnavSockets make_sockets(const std::string& path) {
  std::optional<SpnavSockets> sockets = listen_spnav(path);
  if (!sockets) {
    throw ConfigError(
        "spnav socket {}: it is served already, by `tagwrench spnav` or for `tagwrench run`; "
        "choose another path with --socket, or use that one",
        path);
  }
  return std::move(*sockets);
}

struct SpnavOptions {
  std::string socket;
  std::vector<int> inherited;  ///< the listening sockets: of programs, of the bridge
};

/// Serves until a signal, or until it is idle for too long.
int serve_spnav(const SpnavOptions& o) {
  const std::string path = spnav_socket_path(o.socket);
  const bool inherited = !o.inherited.empty();
  ::prctl(PR_SET_NAME, "tw-spnav");  // so that a kill by the bridge's name spares it
  const UniqueFd stop = termination_fd();
  SpnavSockets sockets =
      inherited ? inherited_spnav(path, o.inherited[0], o.inherited[1]) : make_sockets(path);
  SpnavDaemonOptions options;
  if (inherited) options.idle_end = kIdle;
  log_info("spnav: serving {}; programs find it when started with SPNAV_SOCKET={}", path, path);
  const std::unique_ptr<ServiceWatch> watch = inherited ? nullptr : ServiceWatch::open();
  if (watch != nullptr) watch->ready("serving " + path);
  run_spnav_daemon(std::move(sockets), options, stop.get());
  return 0;
}

}  // namespace

void spnav_command(command_line::Command program) {
  const auto o = std::make_shared<SpnavOptions>();
  auto verb = program.add_subcommand(
      "spnav", "hold the socket that CAD programs connect to, whatever becomes of `tagwrench run`");
  verb.footer(
      "`tagwrench run --output spnav[:PATH]` feeds it, and starts one by itself where there is "
      "none. Programs that use libspnav find it when started with SPNAV_SOCKET=PATH.");
  verb.add_option("--socket", o->socket,
                  "PATH; without it tagwrench/spnav.sock in $XDG_RUNTIME_DIR, and for root "
                  "/var/run/spnav.sock if no spacenavd has it");
  verb.add_option("--inherited", o->inherited).delimiter(',').expected(2).hidden();
  verb.runs([o] { return serve_spnav(*o); });
}

}  // namespace tagwrench
