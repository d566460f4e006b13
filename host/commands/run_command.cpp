#include "host/commands/run_command.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cctype>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <utility>

#include "host/app/input.h"
#include "host/app/outputs.h"
#include "host/app/pipeline.h"
#include "host/app/sources.h"
#include "host/commands/count_text.h"
#include "host/commands/run_input.h"
#include "host/commands/run_web.h"
#include "host/core/config_error.h"
#include "host/core/log.h"
#include "host/core/os/termination.h"
#include "host/output/service_watch.h"
#include "host/sensor/default_profile.h"
#include "host/sensor/sensor_config.h"
#include "host/sensor/zero_options.h"
#include "host/source/region_source.h"

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

/// The program that connected last of those that are connected.
std::string_view last_program(const SpnavOutput& output) {
  if (output.programs().empty()) return {};
  return output.programs().back().name.data();
}

/// Where requests come in, for who has a device on his profiles.
std::optional<ControlSocket> control_of(const RunOptions& options, const Outputs& outputs,
                                        bool pages) {
  const bool on_hid = outputs.any_hid_asked();
  if (!outputs.any_moves() && !on_hid && !pages && options.profiles.empty()) return {};
  try {
    const std::string path = control_path(options.name);
    if (!on_hid || !listens(path)) return ControlSocket(path);
  } catch (const ConfigError& e) {
    log_info(fmt::format("running without `tagwrench control`: {}", e.what()));
    return {};
  }
  // Two devices with one serial number would be mixed up by whoever opens them by it.
  throw ConfigError(fmt::format(
      "--name {}: a bridge of this name runs already; stop it, or give this one another name",
      options.name));
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

/// Says how far the zero went, if it is far enough to be seen.
void say_zero(const ZeroTracking& zero, const Vector6& range, double band) {
  constexpr double kSeen = 5e-4;  // of the range
  const Vector6& moved = zero.moved();
  double most = 0;
  for (int i = 0; i < 6; ++i) {
    if (range[i] > 0 && range[i] < kUnknownRange)
      most = std::max(most, std::abs(moved[i]) / range[i]);
  }
  if (most < kSeen) return;
  log_info(fmt::format(
      "the zero followed what read while nobody touched: by {:.3g} {:.3g} {:.3g} N, {:.3g} {:.3g} "
      "{:.3g} mN m, {:.2g} % of the range{}",
      moved[0], moved[1], moved[2], moved[3] * 1e3, moved[4] * 1e3, moved[5] * 1e3, 100 * most,
      most > 0.9 * band ? ", about as far as it may: run `tagwrench zero`" : ""));
}

/// Ends it, and says so. False: something went wrong.
bool end_recording(Recording& recording) {
  const std::string trouble = recording.finish();
  log_info(recording.summary());
  if (!trouble.empty()) log_info(trouble);
  return trouble.empty();
}

std::string summary(const RunReport& report, const SensorConfig& sensor) {
  const double seconds = std::chrono::duration<double>(report.elapsed).count();
  std::string line =
      fmt::format("{} in {:.2f} s ({:.1f} Hz), {} with numbers, {} dropped by the source",
                  count_text(static_cast<std::uint64_t>(report.frames), "frame"), seconds,
                  seconds > 0 ? report.frames / seconds : 0.0, report.with_numbers, report.dropped);
  if (report.skipped > 0)
    line += fmt::format(", {} samples not taken by slow readers", report.skipped);
  if (report.frames > 0 && report.with_numbers == 0) {
    line += "; the target was never held: ";
    if (!report.trouble.empty()) {
      line += report.trouble;
    } else if (report.frames <= static_cast<std::uint64_t>(std::max(0, sensor.rest.frames))) {
      line += fmt::format(
          "its rest pose is learned from the first {} frames (rest.frames); give it more",
          sensor.rest.frames);
    } else {
      line +=
          "are the tags in view, in focus and lit, and are family, ids and number of tags those of "
          "sensor.yaml?";
    }
  }
  return line;
}

/// What outlives a run that lends its camera.
struct Session {
  RunOptions options;
  std::vector<OutputSpec> asked;
  Outputs outputs{asked, !options.record};
  std::unique_ptr<ServiceWatch> watch = ServiceWatch::open();  ///< null: no systemd
  WebBridge* web = nullptr;
  std::uint64_t frames = 0;  ///< of the runs before
  TimePoint start = std::chrono::steady_clock::now();

  /// What goes on while there is no run.
  std::vector<Output*> beside() const {
    std::vector<Output*> all = outputs.all();
    if (watch) all.push_back(watch.get());
    return all;
  }
};

/// Pages are told when a run is over, however it ends.
class WebRun {
 public:
  WebRun(WebBridge* web, std::unique_ptr<WebOutput> output)
      : web_(web), output_(std::move(output)) {}
  WebRun(const WebRun&) = delete;
  WebRun& operator=(const WebRun&) = delete;
  ~WebRun() {
    if (web_ != nullptr) web_->end_run();
  }
  WebOutput* output() const { return output_.get(); }

 private:
  WebBridge* web_;
  std::unique_ptr<WebOutput> output_;
};

/// Where the next run gets its pictures from, if there is one: from where this one does.
void stay_with(const Input& input, RunOptions& options) {
  if (options.source.empty() && input.kind == SourceKind::simulator) options.sensor.clear();
  options.source = input.spec;
}

RunLimits limits_of(const Session& session) {
  RunLimits limits;
  const RunOptions& options = session.options;
  if (options.frames) limits.frames = static_cast<std::uint64_t>(*options.frames) - session.frames;
  if (options.seconds) {
    limits.time =
        std::chrono::duration_cast<Duration>(std::chrono::duration<double>(*options.seconds));
    if (session.frames > 0)
      *limits.time -= std::min(*limits.time, std::chrono::steady_clock::now() - session.start);
  }
  return limits;
}

/// A source whose part that is read can be chosen while it runs.
RegionSource& choose_region(Input& input, bool narrow) {
  auto region = std::make_unique<RegionSource>(std::move(input.source), narrow);
  RegionSource& chosen = *region;
  input.source = std::move(region);
  return chosen;
}

std::unique_ptr<WebOutput> begin_web_run(const Session& session, const Input& input,
                                         RegionSource* source, RunBoard* board, bool profiles) {
  if (session.web == nullptr) return nullptr;
  WebOutput::Parts parts;
  parts.source = source;
  parts.board = board;
  parts.programs = session.outputs.programs();
  return session.web->begin_run(
      run_facts(session.options, session.asked, input, board != nullptr, profiles), parts);
}

/// The exit status; nothing: the camera is wanted for something else, and the run goes on after it.
std::optional<int> run_once(Session& session) {
  RunOptions& options = session.options;
  std::unique_ptr<RunBoard> board;
  if (!options.board.empty()) {
    BoardOptions board_options;
    board_options.port = options.board == "auto" ? "" : options.board;
    board_options.cells_file = options.cells;
    board = std::make_unique<RunBoard>(board_options);
    if (!board->connected()) return 0;
  }
  // Last of all what does not wait: a camera's frames, the simulated sensor's second at rest.
  std::optional<Input> found = open_run_input(options, session.watch.get());
  if (!found) return 0;
  Input input = std::move(*found);
  const UniqueFd stop = termination_fd();
  check_size(input);
  check_appearance(input);
  stay_with(input, options);
  record::Head head;
  if (options.record) head = recording_head(input, options.record->keep);
  const bool narrow = options.record && head.keep == record::Keep::region;
  RegionSource* region = nullptr;
  if (narrow || session.web != nullptr) region = &choose_region(input, narrow);
  if (board && !board->settle_light(input, stop)) return 0;
  Tracker tracker(input.sensor.camera, input.sensor.target, input.sensor.rest);
  WrenchEstimator wrench(input.sensor.wrench);
  const bool many_profiles = !options.profiles.empty();
  Outputs& outputs = session.outputs;
  std::optional<ControlSocket> control = control_of(options, outputs, session.web != nullptr);
  const bool has_control = control.has_value();
  ProfileManager profiles(ProfileFiles(options.profiles, default_profile(input.sensor)),
                          std::move(control), many_profiles ? FocusWatch::open() : std::nullopt);
  const ZeroOptions zero_limits =
      zero_options(input.sensor, wrench.tool(), !options.no_zero_tracking);
  ZeroTracking zero(zero_limits);
  // Only a source that waits for its reader may be made to wait.
  const bool lossless = options.fast && input.source->poll_fd() < 0;
  const std::string source_text = "source: " + input.source->format().description;
  outputs.open({.sensor = input.sensor,
                .source = input.source->format().description,
                .name = options.name,
                .lossless = lossless});
  std::unique_ptr<Output> board_output;
  if (board) {
    const OutputSpec* reference = find_output(session.asked, OutputKind::reference);
    board_output = board->output(input.sensor, reference == nullptr ? "" : reference->argument);
  }
  if (many_profiles && outputs.programs() != nullptr)
    profiles.follow_programs([&programs = *outputs.programs()] { return last_program(programs); });
  log_info(source_text);
  if (!input.sensor.completed_axes.empty()) {
    log_info(
        fmt::format("not calibrated, but as the springs are described: {}; their standard "
                    "deviations say how little is known",
                    input.sensor.completed_axes));
  }
  if (session.watch) session.watch->ready(source_text);

  const RunLimits limits = limits_of(session);
  RunReport report;
  std::optional<Recording> recording;
  {
    const WebRun web(session.web, begin_web_run(session, input, region, board.get(), has_control));
    Watchdog watchdog(outputs.devices());
    FrameLog* log = web.output();
    if (options.record) {
      recording.emplace(*options.record, head, lossless, limits.frames, limits.time);
      if (board) board->record_to(recording->writer());
      if (web.output() != nullptr) web.output()->pass_on_to(&*recording);
      if (log == nullptr) log = &*recording;
    }
    std::vector<Output*> fed = outputs.all();
    if (board_output) fed.push_back(board_output.get());
    if (session.watch) fed.push_back(session.watch.get());
    if (web.output() != nullptr) fed.push_back(web.output());
    if (recording) fed.push_back(&*recording);
    Pipeline pipeline(*input.source, tracker, wrench, profiles, fed, watchdog,
                      session.web == nullptr ? stop.get() : session.web->end_fd(), log);
    pipeline.follow_zero(zero);
    if (web.output() != nullptr) web.output()->follow_skipped(pipeline.so_far().skipped);
    report = pipeline.run(limits);
  }
  session.frames += report.frames;
  if (report.end == RunReport::End::interrupted && !termination_requested()) {
    outputs.close_for_job();
    return {};
  }
  board_output.reset();
  outputs.close();  // neutral, then gone, before anything else is said
  session.watch.reset();
  const bool recorded = !recording || end_recording(*recording);
  if (report.end == RunReport::End::output_failed) {
    if (recorded) log_info(report.failure);
    return 1;
  }
  log_info(summary(report, input.sensor));
  say_zero(zero, zero_limits.range, zero_limits.band);
  if (const std::string unusable = input.source->unusable(); !unusable.empty()) log_info(unusable);
  return recorded ? 0 : 1;
}

/// One run after the other, as pages want the camera and give it back.
int run_with_pages(Session& session) {
  const UniqueFd stop = termination_fd();
  const std::unique_ptr<WebBridge> web = open_web(session.options, session.asked, stop);
  session.web = web.get();
  for (bool first = true;; first = false) {
    bool again = false;
    try {
      if (const std::optional<int> status = run_once(session)) return *status;
      again = web->lend_camera(session.beside());
    } catch (const ConfigError& e) {
      if (first) throw;
      log_info(e.what());
      again = web->wait_after(e.what(), session.beside());
    }
    if (!again) return 0;
  }
}

}  // namespace

int run(const RunOptions& given) {
  const UniqueFd caught = termination_fd();  // what comes while it is set up ends it in order, too
  const std::vector<OutputSpec> asked = parse_outputs(given.outputs);  // refused before anything
  check_board(given, asked);                                           // is opened or lit
  check_name(given.name);
  const bool pages = has_web(given, asked);
  Session session{with_own_sensor(given), asked};
  if (session.options.record) check_recording(*session.options.record);
  return pages ? run_with_pages(session) : *run_once(session);
}

RunCommand::RunCommand(command_line::Command program)
    : verb_(program.add_subcommand("run", "track the tags, compute the wrench, feed the outputs")) {
  verb_.add_option("--sensor", options_.sensor,
                   "sensor.yaml of this sensor; without it, for a camera, the one "
                   "in\n~/.config/tagwrench if it is there");
  verb_.add_option("--source", options_.source, source_help());
  verb_.add_option("--output", options_.outputs, output_help());
  verb_.add_option("--profile", options_.profiles,
                   "how pushes become motion: cad, game, research, a file, or a folder of them;\n"
                   "several: the first is in force until a program's window, a gesture or\n"
                   "`tagwrench control` chooses another");
  verb_
      .add_option("--name", options_.name,
                  "of the sensor, where there are two: the serial number of its devices")
      .capture_default_str();
  verb_.add_option("--frames", options_.frames, "end after N frames")
      .check(command_line::range(1, kMaxRunFrames));
  verb_.add_option("--seconds", options_.seconds, "end after S seconds")
      .check(command_line::seconds());
  verb_.add_flag("--fast", options_.fast,
                 "sources that are not live run as fast as they can, no frame dropped");
  verb_.add_flag("--wait", options_.wait,
                 "for the camera, if it is not there: what a service wants");
  verb_.add_flag("--no-zero-tracking", options_.no_zero_tracking,
                 "the zero does not follow what reads while nobody touches the sensor");
  verb_.add_option("--board", options_.board,
                   "serial port of the board that lights the tags and reads load cells:\n"
                   "a path, usb:VENDOR:PRODUCT[:SERIAL], or auto for the only one");
  verb_.add_flag(
      "--open", options_.web.open,
      "pages as with --output web, but beside the usual outputs, and open in the browser");
  verb_.add_option("--web-token", options_.web.token_file,
                   "file with the token that pages need on an address that others reach;\n"
                   "made where it is not there");
  verb_.add_option("--recordings", options_.web.recordings,
                   "folder of what pages record; without it ~/.local/share/tagwrench/recordings");
  verb_.add_option("--web-pages", options_.web.pages).hidden();
  verb_.add_option("--cells", options_.cells,
                   "calibration file of its load cells; without it the one kept for this board");
}

}  // namespace tagwrench
