#include "host/app/run_web.h"

#include <fmt/format.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>

#include "host/app/recording.h"
#include "host/core/config_error.h"
#include "host/core/log.h"
#include "host/core/os/config_folder.h"
#include "host/core/os/uninterrupted.h"
#include "host/source/v4l2_mode.h"
#include "host/web/bridge/recording_folder.h"
#include "host/web/server/token_file.h"
#include "host/web/server/web_place.h"

namespace tagwrench {
namespace {

namespace fs = std::filesystem;

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

}  // namespace

bool has_web(const RunOptions& options, std::span<const OutputSpec> outputs) {
  if (find_output(outputs, OutputKind::pages) != nullptr || options.web.open) return true;
  if (!options.web.token_file.empty())
    throw ConfigError("--web-token: is for pages; add --output web:ADDRESS:PORT");
  if (!options.web.recordings.empty())
    throw ConfigError("--recordings: is for pages; add --output web");
  return false;
}

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
  log_info(
      fmt::format("pages: {}{}", token_made ? bridge->url_with_token() : bridge->url(),
                  web.server.token.empty() || token_made
                      ? ""
                      : fmt::format("#token=... (the token is in {})", options.web.token_file)));
  bridge->start();
  if (options.web.open) open_in_browser(bridge->url_with_token());
  return bridge;
}

RunFacts run_facts(const RunOptions& options, std::span<const OutputSpec> outputs,
                   const Input& input, bool board, bool profiles) {
  RunFacts facts;
  facts.name = options.name;
  facts.format = input.source->format();
  facts.sensor = input.sensor;
  const bool is_file = input.sensor_text.empty() && !input.recorded;
  if (is_file) facts.place.sensor = fs::absolute(input.sensor_name).string();
  facts.place.source = input.spec;
  facts.place.source_kind = input.kind;
  facts.place.board = options.board;
  facts.place.cells = options.cells;
  facts.place.calibrated = !input.sensor.calibration.empty();
  // What a job would cut off.
  facts.place.kept = options.record || find_output(outputs, OutputKind::reference) != nullptr;
  if (input.kind == SourceKind::camera) facts.camera_device = parse_v4l2_spec(input.argument).path;
  facts.board = board;
  facts.profiles = profiles;
  if (!options.record) facts.head = recording_head(input, record::Keep::raw);
  return facts;
}

}  // namespace tagwrench
