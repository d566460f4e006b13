// `tagwrench run` and `tagwrench record`, which is a run that is kept in a file (host/app/run.h);
// and other verbs that are little more than their options: `control`, a request to a sensor that
// runs; `read`, what 6-DOF and wrench HID devices say, ours and others; `sim`, pictures of the
// simulated sensor in a folder; `spnav`, the daemon of the spnav socket, by hand or as a service.
// `manual` writes the man pages and `complete` says what may be typed next: the package and the
// shells ask for them, not people, so no help names them.

#include <fmt/format.h>
#include <sys/prctl.h>

#include <chrono>
#include <filesystem>
#include <memory>
#include <optional>
#include <string_view>
#include <utility>
#include <vector>

#include "host/app/input.h"
#include "host/app/outputs.h"
#include "host/app/run.h"
#include "host/app/scenario_config.h"
#include "host/commands/commands.h"
#include "host/core/config_error.h"
#include "host/core/log.h"
#include "host/core/os/atomic_file.h"
#include "host/core/os/termination.h"
#include "host/motion/control_socket.h"
#include "host/motion/profile_config.h"
#include "host/output/spnav_daemon.h"
#include "host/output/watchdog.h"
#include "host/source/simulator/simulator_source.h"
#include "host/tools/packaging/man_page.h"
#include "host/tools/reading/reader.h"

namespace tagwrench {
namespace {

void add_input_and_output(command_line::Command verb, RunOptions& o) {
  verb.add_option("--sensor", o.sensor,
                  "sensor.yaml of this sensor; without it, for a camera, the one "
                  "in\n~/.config/tagwrench if it is there");
  verb.add_option("--source", o.source, source_help());
  verb.add_option("--output", o.outputs, output_help());
}

void add_course(command_line::Command verb, RunOptions& o) {
  verb.add_option("--frames", o.frames, "end after N frames")
      .check(command_line::range(1, 2'000'000'000));
  verb.add_option("--seconds", o.seconds, "end after S seconds").check(command_line::seconds());
  verb.add_flag("--fast", o.fast,
                "sources that are not live run as fast as they can, no frame dropped");
  verb.add_flag(kDespiteDamage, o.despite_damage, kDespiteDamageHelp);
  verb.add_flag("--no-zero-tracking", o.no_zero_tracking,
                "the zero does not follow what reads while nobody touches the sensor");
  verb.add_option("--board", o.board,
                  "serial port of the board that lights the tags and reads load cells:\n"
                  "a path, usb:VENDOR:PRODUCT[:SERIAL], or auto for the only one");
  verb.add_option("--cells", o.cells,
                  "calibration file of its load cells; without it the one kept for this board");
}

struct ControlOptions {
  std::string name = "sensor";
  std::string profile;
  std::string program;
};

/// 0: done; 1: the sensor refuses. Throws ConfigError if none runs.
int request(const std::string& name, const std::string& words) {
  const std::string answer = ask(control_path(name), words);
  constexpr std::string_view kDone = "ok: ";
  if (answer.starts_with(kDone)) {
    print_data(answer.substr(kDone.size()));
    return 0;
  }
  log_info(answer.substr(0, answer.find('\n')));
  return 1;
}

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

struct SpnavDaemonVerb {
  std::string socket;
  std::vector<int> inherited;  ///< the listening sockets: of programs, of the bridge
};

/// Serves until a signal, or until it is idle for too long.
int serve_spnav(const SpnavDaemonVerb& o) {
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

struct ManualOptions {
  std::string folder;
  std::vector<std::string> typed;
};

void write_pages(command_line::Command program, const std::string& folder) {
  namespace fs = std::filesystem;
  std::error_code error;
  fs::create_directories(folder, error);
  for (const ManPage& page : man_pages(program, TAGWRENCH_VERSION)) {
    const fs::path path = fs::path(folder) / (page.name + ".1");
    write_atomically(path, page.text);
  }
}

/// First whether files fit and behind which words, then what may come, a line each.
void print_completion(command_line::Command program, const std::vector<std::string>& typed) {
  std::vector<std::string> profiles;
  for (const ReadyProfile& profile : ready_profiles()) profiles.emplace_back(profile.name);
  const Completion found = complete(program, typed, profiles);
  fmt::print("{} {}\n", found.files ? "files" : "none", found.before_file);
  for (const std::string& word : found.words) fmt::print("{}\n", word);
}

}  // namespace

void run_command(command_line::Command program) {
  const auto o = std::make_shared<RunOptions>();
  auto verb = program.add_subcommand("run", "track the tags, compute the wrench, feed the outputs");
  add_input_and_output(verb, *o);
  verb.add_option("--profile", o->profiles,
                  "how pushes become motion: cad, game, research, a file, or a folder of them;\n"
                  "several: the first is in force until a program's window, a gesture or\n"
                  "`tagwrench control` chooses another");
  verb.add_option("--name", o->name,
                  "of the sensor, where there are two: the serial number of its devices")
      .capture_default_str();
  add_course(verb, *o);
  verb.add_flag("--wait", o->wait, "for the camera, if it is not there: what a service wants");
  verb.add_flag(
      "--open", o->web.open,
      "pages as with --output web, but beside the usual outputs, and open in the browser");
  verb.add_option("--web-token", o->web.token_file,
                  "file with the token that other computers, and other users of this one, need\n"
                  "for pages; made where it is not there");
  verb.add_option("--recordings", o->web.recordings,
                  "folder of what pages record; without it ~/.local/share/tagwrench/recordings");
  verb.add_option("--web-pages", o->web.pages).hidden();
  verb.runs([o] { return run(*o); });
}

void record_command(command_line::Command program) {
  struct Options : RunOptions {
    RecordOptions kept;
    std::string keep = "raw";
  };
  const auto o = std::make_shared<Options>();
  auto verb = program.add_subcommand(
      "record", "as run, and keep all of it in a file: frames, tracks, samples, references");
  verb.add_option("--out", o->kept.file, "the recording, a new file").required();
  verb.add_option("--keep", o->keep,
                  "what of each frame is kept:\n"
                  "  raw       as it came from the source (MJPG stays MJPG)\n"
                  "  region    grey pixels of the part around the tags\n"
                  "  none      nothing; such a recording cannot be replayed")
      .check(command_line::one_of({"raw", "region", "none"}))
      .capture_default_str();
  add_input_and_output(verb, *o);
  add_course(verb, *o);
  verb.runs([o] {
    o->kept.keep = o->keep == "raw"      ? record::Keep::raw
                   : o->keep == "region" ? record::Keep::region
                                         : record::Keep::none;
    o->record = o->kept;
    return run(*o);
  });
}

void control_command(command_line::Command program) {
  const auto o = std::make_shared<ControlOptions>();
  auto verb = program.add_subcommand("control", "ask something of a sensor that runs");
  verb.require_subcommand();
  verb.add_option("--name", o->name, "of the sensor, as `tagwrench run --name` has it")
      .capture_default_str();
  verb.add_subcommand("zero", "what reads with hands off is nothing from now on").runs([o] {
    return request(o->name, "zero");
  });
  verb.add_subcommand("next", "the next of its profiles").runs([o] {
    return request(o->name, "next");
  });
  auto profile = verb.add_subcommand("profile", "the profile of this name");
  profile.add_option("profile", o->profile, "its name").required();
  profile.runs([o] { return request(o->name, "profile " + o->profile); });
  auto window = verb.add_subcommand(
      "window", "the program that has the focus, from a script of the desktop's");
  window.add_option("program", o->program, "its class or application id; without it: nobody knows");
  window.runs([o] { return request(o->name, "window " + o->program); });
  verb.add_subcommand("status", "which profiles it has, and the one in force").runs([o] {
    return request(o->name, "status");
  });
}

void read_command(command_line::Command program) {
  struct Options : ReadOptions {
    std::optional<double> end;
    bool list = false;
    bool json = false;
    bool csv = false;
  };
  const auto o = std::make_shared<Options>();
  auto verb = program.add_subcommand(
      "read", "live values of wrench sensors and 6-DOF devices on HID, ours and others");
  verb.footer(
      "Forces are in N, torques in N m; pucks have counts. Rate, jitter (standard deviation and "
      "longest of the intervals), missing frames and latency (capture to arrival here, for a live "
      "sensor on this computer) come with each line and in the summary.");
  verb.add_option(
      "device", o->device,
      "serial, VID:PID or path; without it the only wrench sensor, or else the only 6-DOF device");
  auto list = verb.add_flag("--list", o->list, "list what is plugged in, and end");
  auto seconds =
      verb.add_option("--seconds", o->end, "end after S seconds").check(command_line::seconds());
  auto wait = verb.add_flag("--wait", o->wait,
                            "wait for a device that is not there, and again when it is gone");
  auto json = verb.add_flag("--json", o->json, "one JSON object a report");
  auto csv = verb.add_flag("--csv", o->csv, "one CSV row a report");
  auto log = verb.add_option("--log", o->log, "CSV file to write beside what is printed");
  json.excludes(csv);
  for (command_line::Option other : {seconds, wait, json, csv, log}) list.excludes(other);
  verb.runs([o] {
    if (o->list) return list_hid();
    using Style = ReadOptions::Style;
    o->style = o->json ? Style::json : o->csv ? Style::csv : Style::people;
    if (o->end)
      o->time = std::chrono::duration_cast<Duration>(std::chrono::duration<double>(*o->end));
    return read_hid(*o, termination_fd().get());
  });
}

void sim_command(command_line::Command program) {
  struct Options {
    std::string scenario;
    std::string folder;
    int frames = 0;
  };
  const auto o = std::make_shared<Options>();
  auto verb = program.add_subcommand(
      "sim", "render the simulated sensor to a folder: frames, truth, sensor.yaml");
  verb.add_option("--scenario", o->scenario, "scenario YAML; without it the default scenario");
  verb.add_option("--out", o->folder, "folder to write").required();
  verb.add_option("--frames", o->frames, "number of frames")
      .required()
      .check(command_line::range(1, 10'000'000));
  verb.runs([o] {
    sim::export_folder(o->scenario.empty() ? sim::Scenario{} : load_scenario(o->scenario),
                       o->folder, o->frames);
    log_info("{} frames with truth and sensor.yaml in {}", o->frames, o->folder);
    return 0;
  });
}

void spnav_command(command_line::Command program) {
  const auto o = std::make_shared<SpnavDaemonVerb>();
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

void manual_command(command_line::Command program) {
  const auto o = std::make_shared<ManualOptions>();
  auto manual = program.add_subcommand("manual", "write the man pages").hidden();
  manual.add_option("--out", o->folder, "folder to write").required();
  manual.runs([=] {
    write_pages(program, o->folder);
    return 0;
  });
  auto complete = program.add_subcommand("complete", "what may be typed next").hidden();
  complete.add_option("typed", o->typed, "the words behind the program's name, behind --");
  complete.runs([=] {
    print_completion(program, o->typed);
    return 0;
  });
}

}  // namespace tagwrench
