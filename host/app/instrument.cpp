#include "host/app/instrument.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <utility>

#include "host/core/config_error.h"
#include "host/core/count_text.h"
#include "host/core/log.h"
#include "host/core/os/termination.h"
#include "host/sensor/sensor_config.h"
#include "host/source/v4l2_settings.h"

namespace tagwrench {
namespace {

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
    log_info("running without `tagwrench control`: {}", e.what());
    return {};
  }
  // Two devices with one serial number would be mixed up by whoever opens them by it.
  throw ConfigError(
      "--name {}: a bridge of this name runs already; stop it, or give this one another name",
      options.name);
}

RunLimits limits_of(const RunSession& session) {
  RunLimits limits;
  const RunOptions& options = session.options;
  if (options.frames) limits.frames = static_cast<std::uint64_t>(*options.frames) - session.frames;
  if (options.seconds) {
    limits.time = in_seconds(*options.seconds);
    if (session.frames > 0)
      *limits.time -= std::min(*limits.time, std::chrono::steady_clock::now() - session.start);
  }
  return limits;
}

/// Only a source that waits for its reader may be made to wait.
bool is_lossless(const RunOptions& options, const Input& input) {
  return options.fast && input.source->poll_fd() < 0;
}

ProfileManager profiles_of(const RunOptions& options, const SensorConfig& sensor,
                           std::optional<ControlSocket> control) {
  return ProfileManager(ProfileFiles(options.profiles, default_profile(sensor)), std::move(control),
                        options.profiles.empty() ? nullptr : FocusWatch::open());
}

/// Says how far the zero went, if it is far enough to be seen.
void say_zero(const ZeroTracking& zero, const Vector6& range, double band) {
  constexpr double kSeen = 5e-4;  // of the range
  const Vector6& moved = zero.moved();
  double most = 0;
  for (int i = 0; i < 6; ++i)
    if (range[i] > 0 && range[i] < kUnknownRange)
      most = std::max(most, std::abs(moved[i]) / range[i]);
  if (most < kSeen) return;
  log_info(
      "the zero followed what read while nobody touched: by {:.3g} {:.3g} {:.3g} N, {:.3g} {:.3g} "
      "{:.3g} mN m, {:.2g} % of the range{}",
      moved[0], moved[1], moved[2], moved[3] * 1e3, moved[4] * 1e3, moved[5] * 1e3, 100 * most,
      most > 0.9 * band ? ", about as far as it may: run `tagwrench zero`" : "");
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

/// What pages are told. `profiles`: they listen to requests.
RunFacts run_facts(const RunOptions& options, std::span<const OutputSpec> outputs,
                   const Input& input, bool board, bool profiles) {
  RunFacts facts;
  facts.name = options.name;
  facts.format = input.source->format();
  facts.sensor = input.sensor;
  const bool is_file = input.sensor_text.empty() && !input.recorded;
  if (is_file) facts.place.sensor = std::filesystem::absolute(input.sensor_name).string();
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

/// Where the next run gets its pictures from, if there is one: from where this one does.
void stay_with(const Input& input, RunOptions& options) {
  if (options.source.empty() && input.kind == SourceKind::simulator) options.sensor.clear();
  options.source = input.spec;
}

/// A source whose part that is read can be chosen while it runs.
RegionSource& choose_region(Input& input, bool narrow) {
  auto region = std::make_unique<RegionSource>(std::move(input.source), narrow);
  RegionSource& chosen = *region;
  input.source = std::move(region);
  return chosen;
}

}  // namespace

std::unique_ptr<Instrument> Instrument::build(RunSession& session) {
  RunOptions& options = session.options;
  Found found;
  found.board = open_board(options.board, options.cells);
  if (found.board && !found.board->connected()) return nullptr;
  // Last of all what does not wait: a camera's frames, the simulated sensor's second at rest.
  std::optional<Input> input = open_run_input(options, session.watch.get());
  if (!input) return nullptr;
  found.input = std::move(*input);
  found.stop = termination_fd();
  check_size(found.input);
  check_appearance(found.input);
  stay_with(found.input, options);
  if (options.record) found.head = recording_head(found.input, options.record->keep);
  const bool narrow = found.head && found.head->keep == record::Keep::region;
  if (narrow || session.pages) found.region = &choose_region(found.input, narrow);
  if (found.board && !found.board->settle_light(found.input, found.stop)) return nullptr;
  return std::unique_ptr<Instrument>(new Instrument(
      session, std::move(found), control_of(options, session.outputs, session.pages != nullptr)));
}

Instrument::Instrument(RunSession& session, Found found, std::optional<ControlSocket> control)
    : session_(session),
      board_(std::move(found.board)),
      input_(std::move(found.input)),
      stop_(std::move(found.stop)),
      tracker_(make_tracker(input_.sensor)),
      wrench_(input_.sensor.wrench),
      has_control_(control.has_value()),
      profiles_(profiles_of(session.options, input_.sensor, std::move(control))),
      zero_limits_(zero_options(input_.sensor, wrench_.tool(), !session.options.no_zero_tracking)),
      zero_(zero_limits_) {
  open_outputs();
  announce();
  limits_ = limits_of(session_);
  if (session_.pages) {
    pages_.emplace(
        *session_.pages,
        run_facts(session_.options, session_.asked, input_, board_ != nullptr, has_control_),
        WebOutput::Parts{.source = found.region,
                         .board = board_.get(),
                         .programs = session_.outputs.programs()});
  }
  watchdog_.emplace(session_.outputs.devices());
  if (found.head) {  // of all that is seen, what is said to people and what the board says included
    recording_.emplace(*session_.options.record, *found.head, is_lossless(session_.options, input_),
                       limits_.frames, limits_.time);
    if (board_) board_->record_to(recording_->writer());
    if (pages_) pages_->output().pass_on_to(&*recording_);
  }
  FrameLog* log = nullptr;
  if (pages_) log = &pages_->output();
  if (!pages_ && recording_) log = &*recording_;
  pipeline_.emplace(*input_.source, tracker_, wrench_, profiles_, fed(), *watchdog_,
                    pages_ ? session_.pages->end_fd() : stop_.get(), log);
  pipeline_->follow_zero(zero_);
  if (pages_) pages_->output().follow_skipped(pipeline_->so_far().skipped);
}

Instrument::~Instrument() = default;

void Instrument::open_outputs() {
  const RunOptions& options = session_.options;
  Outputs& outputs = session_.outputs;
  outputs.open({.sensor = input_.sensor,
                .source = input_.source->format().description,
                .name = options.name,
                .lossless = is_lossless(options, input_)});
  if (board_) {
    const OutputSpec* reference = find_output(session_.asked, OutputKind::reference);
    board_output_ = board_->output(input_.sensor, reference == nullptr ? "" : reference->argument);
  }
  if (!options.profiles.empty() && outputs.programs() != nullptr)
    profiles_.follow_programs([programs = outputs.programs()] { return last_program(*programs); });
}

void Instrument::announce() const {
  const std::string source = "source: " + input_.source->format().description;
  log_info(source);
  for (const std::string& line : in_force(input_.sensor)) log_info(line);
  if (!input_.sensor.completed_axes.empty()) {
    log_info(
        "not calibrated, but as the springs are described: {}; their standard deviations say how "
        "little is known",
        input_.sensor.completed_axes);
  }
  if (session_.watch) session_.watch->ready(source);
}

std::vector<Output*> Instrument::fed() {
  std::vector<Output*> all = session_.outputs.all();
  if (board_output_) all.push_back(board_output_.get());
  if (session_.watch) all.push_back(session_.watch.get());
  if (pages_) all.push_back(&pages_->output());
  if (recording_) all.push_back(&*recording_);
  return all;
}

/// Pages are told, and the watchdog is dismissed, before outputs go.
void Instrument::end_loop(const RunReport& report) {
  session_.frames += report.frames;
  pipeline_.reset();
  watchdog_.reset();
  pages_.reset();
}

void Instrument::lend(const RunReport& report) {
  end_loop(report);
  board_output_.reset();
  session_.outputs.close_for_job();
}

int Instrument::end(const RunReport& report) {
  end_loop(report);
  board_output_.reset();
  session_.outputs.close();  // neutral, then gone, before anything else is said
  session_.watch.reset();
  const bool recorded = !recording_ || end_recording(*recording_);
  if (report.end == RunReport::End::output_failed) {
    if (recorded) log_info(report.failure);
    return 1;
  }
  log_info(summary(report, input_.sensor));
  say_zero(zero_, zero_limits_.range, zero_limits_.band);
  if (const std::string unusable = input_.source->unusable(); !unusable.empty()) log_info(unusable);
  const bool whole = session_.options.despite_damage || !input_.source->damaged();
  return recorded && whole ? 0 : 1;
}

}  // namespace tagwrench
