#include "host/verbs/run_command.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cctype>
#include <cerrno>
#include <csignal>
#include <cstring>
#include <filesystem>
#include <memory>
#include <optional>
#include <utility>

#include "host/config/sensor_config.h"
#include "host/config_error.h"
#include "host/input.h"
#include "host/output/service_watch.h"
#include "host/pipeline.h"
#include "host/source/region_source.h"
#include "host/tell.h"
#include "host/verbs/count_text.h"
#include "host/verbs/run_input.h"
#include "host/verbs/run_outputs.h"

namespace tagwrench {
namespace {

/// The program that connected last of those that are connected.
std::string_view last_program(const SpnavOutput& output) {
  if (output.programs().empty()) return {};
  return output.programs().back().name.data();
}

/// Where wishes come in, for who has a device on his desk.
std::optional<ControlSocket> control_of(const RunOptions& options) {
  const std::vector<Spec> specs = output_specs(options);
  const bool device = (specs.empty() && !options.record) ||
                      std::any_of(specs.begin(), specs.end(), is_input_device);
  const bool on_hid = std::any_of(specs.begin(), specs.end(), is_hid_device);
  if (!device && !on_hid && options.profiles.empty()) return {};
  try {
    const std::string path = control_path(options.name);
    if (!on_hid || !listens(path)) return ControlSocket(path);
  } catch (const ConfigError& e) {
    tell(fmt::format("running without `tagwrench control`: {}", e.what()));
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

/// What reads as nothing, as samples have it, and whether it may follow.
ZeroOptions zero_options(const SensorConfig& sensor, const Matrix6& tool, bool may_follow) {
  ZeroOptions options;
  options.follow = may_follow && sensor.zero.follow;
  options.range = range_through(tool, sensor.wrench.range);
  options.set = tool * sensor.zero.set;
  options.band = sensor.zero.band;
  options.rate = sensor.zero.rate;
  return options;
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
  tell(fmt::format(
      "the zero followed what read while nobody touched: by {:.3g} {:.3g} {:.3g} N, {:.3g} {:.3g} "
      "{:.3g} mN m, {:.2g} % of the range{}",
      moved[0], moved[1], moved[2], moved[3] * 1e3, moved[4] * 1e3, moved[5] * 1e3, 100 * most,
      most > 0.9 * band ? ", about as far as it may: run `tagwrench zero`" : ""));
}

/// What is recorded of the run, told to all who have something to say. The guardian of the outputs
/// has been forked already: the recording has a thread.
Recording& start_recording(const RunOptions& options, const record::Head& head, const Input& input,
                           const RunLimits& limits, RunBoard* board, Outputs& outputs) {
  const bool lossless = options.fast && input.source->poll_fd() < 0;
  auto recording =
      std::make_unique<Recording>(*options.record, head, lossless, limits.frames, limits.time);
  Recording& started = *recording;
  outputs.all.push_back(std::move(recording));
  if (board != nullptr) board->record_to(started.writer());
  return started;
}

/// Ends it, and says so. False: something went wrong.
bool end_recording(std::unique_ptr<Output> output) {
  auto& recording = static_cast<Recording&>(*output);
  const std::string trouble = recording.finish();
  tell(recording.summary());
  if (!trouble.empty()) tell(trouble);
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

}  // namespace

int run(const RunOptions& given) {
  std::signal(SIGPIPE, SIG_IGN);  // a closed pipe becomes an error code
  output_specs(given);            // refused before anything is opened or lit
  check_name(given.name);
  const RunOptions options = with_own_sensor(given);
  std::unique_ptr<ServiceWatch> watch = ServiceWatch::open();
  if (options.record) check_recording(*options.record);
  std::unique_ptr<RunBoard> board;
  if (!options.board.empty()) {
    BoardOptions board_options;
    board_options.port = options.board == "auto" ? "" : options.board;
    board_options.cells_file = options.cells;
    board = std::make_unique<RunBoard>(board_options);
    if (!board->connected()) return 0;
  }
  // Last of all what does not wait: a camera's frames, the simulated sensor's second at rest.
  std::optional<Input> found = open_run_input(options, watch.get());
  if (!found) return 0;
  Input input = std::move(*found);
  const UniqueFd stop = signals_as_fd();
  check_size(input);
  check_appearance(input);
  record::Head head;
  if (options.record) {
    head = recording_head(input, options.record->keep);
    if (head.keep == record::Keep::region)
      input.source = std::make_unique<RegionSource>(std::move(input.source));
  }
  if (board && !board->settle_light(input, stop)) return 0;
  Tracker tracker(input.sensor.camera, input.sensor.target, input.sensor.rest);
  WrenchEstimator wrench(input.sensor.wrench);
  const bool many_profiles = !options.profiles.empty();
  Desk desk(ProfileFiles(options.profiles, input.sensor), control_of(options),
            many_profiles ? FocusWatch::open() : std::nullopt);
  const ZeroOptions zero_limits =
      zero_options(input.sensor, wrench.tool(), !options.no_zero_tracking);
  ZeroTracking zero(zero_limits);
  Outputs outputs = open_outputs(options, input, board.get());
  if (many_profiles && outputs.programs != nullptr)
    desk.follow_programs([&programs = *outputs.programs] { return last_program(programs); });
  tell("source: " + input.source->format().description);
  if (watch != nullptr) {
    watch->ready("source: " + input.source->format().description);
    outputs.all.push_back(std::move(watch));
  }

  RunLimits limits;
  if (options.frames) limits.frames = static_cast<std::uint64_t>(*options.frames);
  if (options.seconds)
    limits.time =
        std::chrono::duration_cast<Duration>(std::chrono::duration<double>(*options.seconds));
  RunReport report;
  {
    DeadMan dead_man(outputs.devices);
    Recording* recording = nullptr;
    if (options.record)
      recording = &start_recording(options, head, input, limits, board.get(), outputs);
    Pipeline pipeline(*input.source, tracker, wrench, desk, outputs.all, dead_man, stop.get(),
                      recording);
    pipeline.follow_zero(zero);
    report = pipeline.run(limits);
  }
  std::unique_ptr<Output> recording;
  if (options.record) {
    recording = std::move(outputs.all.back());
    outputs.all.pop_back();
  }
  outputs.all.clear();  // neutral, then gone, before anything else is said
  const bool recorded = recording == nullptr || end_recording(std::move(recording));
  if (report.end == RunReport::End::output_failed) {
    if (recorded) tell(report.failure);
    return 1;
  }
  tell(summary(report, input.sensor));
  say_zero(zero, zero_limits.range, zero_limits.band);
  if (const std::string unusable = input.source->unusable(); !unusable.empty()) tell(unusable);
  return recorded ? 0 : 1;
}

}  // namespace tagwrench
