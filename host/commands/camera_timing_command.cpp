// `tagwrench camera-timing`: a camera, a lamp or a screen before it, and a report.
#include <fmt/format.h>

#include <chrono>
#include <functional>
#include <memory>

#include "host/app/board/board_loop.h"
#include "host/app/input.h"
#include "host/app/scenario_config.h"
#include "host/commands/commands.h"
#include "host/core/config_error.h"
#include "host/core/log.h"
#include "host/core/os/atomic_file.h"
#include "host/core/os/termination.h"
#include "host/motion/shaping.h"
#include "host/output/hid_outputs.h"
#include "host/output/watchdog.h"
#include "host/source/simulator/simulator_source.h"
#include "host/tools/camera_timing/flip_patches.h"
#include "host/tools/camera_timing/measurement.h"
#include "host/tracker/tracker.h"
#include "host/web/server/web_options.h"
#include "host/wrench/estimate.h"

namespace tagwrench {
namespace {

constexpr int kDone = 0;
constexpr int kFailed = 1;
constexpr double kMin = 3;   // s: enough pictures at 25 Hz
constexpr double kMax = 20;  // s: a bare LED stays cool enough

struct TimingOptions {
  std::string source;
  std::string port;
  std::string sensor;
  std::string json;
  double seconds = 10;
  command_line::Option screen_given;
  std::string screen;     ///< empty: a window
  std::string web_token;  ///< file
  bool fast = false;
};

/// A camera and the lamp before it.
struct Bench {
  std::unique_ptr<BoardLoop> board;  ///< of the lamp; nothing for the simulator's
  Input input;
  std::unique_ptr<PatternLamp> lamp;
  std::string lamp_description;
};

/// The simulator's own lamp, at the camera's own clock.
Bench simulated_bench(const std::string& sensor, const std::string& source, bool fast) {
  const SourceSpec spec = parse_source(source);
  if (!spec.is(SourceKind::simulator)) {
    throw ConfigError(
        "--port sim: the simulated lamp lights the simulated sensor alone; use --source sim or "
        "--source sim:SCENARIO.yaml with it, not {}",
        source);
  }
  const sim::Scenario scenario =
      spec.argument.empty() ? sim::Scenario{} : load_scenario(spec.argument);
  auto lamp = std::make_unique<SimulatedLamp>(!fast);
  Bench bench;
  bench.input.sensor = sensor.empty()
                           ? parse_sensor(sim::sensor_yaml(scenario), "the simulated sensor")
                           : load_sensor(sensor);
  auto camera = std::make_unique<SimulatorSource>(scenario, !fast, lamp.get());
  lamp->set_time_zero(camera->time_zero());
  bench.input.source = std::move(camera);
  bench.lamp = std::move(lamp);
  bench.lamp_description = "simulated, on the camera's own clock";
  return bench;
}

/// A board's LED before a camera. No lamp: a signal came.
Bench board_bench(const std::string& sensor, const std::string& source, const std::string& port,
                  bool fast) {
  if (fast) throw ConfigError("--fast: a board has its own time; leave it out, or use --port sim");
  if (!parse_source(source).is(SourceKind::camera)) {
    throw ConfigError(
        "--port {}: a board lights cameras; use --source v4l2:/dev/videoN with it, or --port sim "
        "for the simulated sensor",
        port);
  }
  Bench bench;
  bench.board = std::make_unique<BoardLoop>(port, link::new_session());
  log_info("waiting for the board's clock to be known");
  if (!bench.board->settle()) return bench;
  bench.input = open_input({sensor, source, false});
  link::BoardLink& link = bench.board->link();
  bench.lamp = std::make_unique<BoardPatternLamp>(
      link.session(),
      [&link] {
        link.send();
        link.service();
      },
      link.poll_fd());
  bench.lamp_description =
      fmt::format("LED of board {} at {}", bench.board->session().hello().board, link.port());
  return bench;
}

void check_report_file(const std::string& file) {
  try {
    check_replaceable(file);
  } catch (const ConfigError&) {
    throw ConfigError("--json {}: cannot be written; name a file in a folder of yours", file);
  }
}

/// What a run does with a frame, to a HID device where one may be made.
class Processing {
 public:
  explicit Processing(const SensorConfig& sensor)
      : tracker_(make_tracker(sensor)), wrench_(sensor.wrench), shaping_(sensor.shaping) {
    try {
      device_ = std::make_unique<WrenchHidOutput>(WrenchHidOptions{});
    } catch (const ConfigError& e) {
      log_info("measured up to the wrench, without HID device: {}", e.what());
    }
  }
  void take(Frame& frame) noexcept {
    const Track track = tracker_.track(frame);
    Sample sample{.sequence = frame.sequence,
                  .capture_time = frame.capture_time,
                  .latency_origin = frame.latency_origin,
                  .dropped = frame.dropped};
    wrench_.estimate(track, sample);
    shaping_.shape(sample);
    if (carries_numbers(sample.status)) ++held_;
    if (device_) device_->send(sample);
  }
  int held() const { return held_; }
  const char* output() const { return device_ ? "HID report" : "wrench"; }

 private:
  Tracker tracker_;
  WrenchEstimator wrench_;
  Shaping shaping_;
  std::unique_ptr<WrenchHidOutput> device_;
  int held_ = 0;
};

void check_screen(const TimingOptions& o) {
  const std::string kind = split_spec(o.screen).kind;
  if (!o.screen.empty() && o.screen != "window" && kind != "web") {
    throw ConfigError(
        "--screen {}: is no screen; use --screen, or --screen web, or web:ADDRESS:PORT", o.screen);
  }
  if (kind != "web" && !o.web_token.empty())
    throw ConfigError("--web-token: is for a page; use it with --screen web:ADDRESS:PORT");
  if (parse_source(o.source).is(SourceKind::simulator)) {
    if (kind == "web")
      throw ConfigError(
          "--screen web: the simulated camera sees no screen; give a camera as --source, or leave "
          "web out");
  } else if (o.fast) {
    throw ConfigError("--fast: a camera has its own time; leave it out");
  }
}

void print(const TimingOptions& o, const std::string& text, const std::string& json) {
  fmt::print("{}", o.json == "-" ? json : text);
  if (!o.json.empty() && o.json != "-") write_atomically(o.json, json);
}

int measure(const TimingOptions& o, FrameSource& source, FlipPatch& patch, const UniqueFd& stop,
            const std::function<std::string()>& screen) {
  log_info("source: " + source.format().description);
  log_info("point the camera at the flipping patch, so that it fills the picture");
  ScreenOptions options;
  options.seconds = o.seconds;
  options.stopped = [&] { return termination_requested(); };
  options.stop_fd = stop.get();
  const ScreenMeasurement measured = measure_screen(source, patch, options);
  if (!measured.refusal.empty()) {
    log_info("camera-timing: " + measured.refusal);
    return kFailed;
  }
  const double period = std::chrono::duration<double>(source.format().period).count();
  print(o, report_text(measured, source.format().description, screen(), period),
        report_json(measured, source.format().description, screen(), period));
  return kDone;
}

int run_with_screen(const TimingOptions& o) {
  const UniqueFd stop = termination_fd();
  const Spec screen = split_spec(o.screen);
  if (parse_source(o.source).is(SourceKind::simulator)) {
    const Bench bench = simulated_bench(o.sensor, o.source, o.fast);
    auto& patch = dynamic_cast<FlipPatch&>(*bench.lamp);
    return measure(o, *bench.input.source, patch, stop,
                   [] { return "simulated, without latency"; });
  }
  if (screen.kind != "web") {
    ScreenWindow window;
    const Input input = open_input({o.sensor, o.source, false});
    return measure(o, *input.source, window, stop, [&] { return window.description(); });
  }
  WebOptions options = parse_web("--screen web", screen.argument);
  options.pages = built_pages();
  std::string token_text;
  if (!o.web_token.empty()) {
    options.token = web_token(o.web_token);
    token_text = "&token=" + token_for_people(options.token, o.web_token);
  }
  PagePatch page(options);
  const Input input = open_input({o.sensor, o.source, false});
  log_info("the page: " + page.url() + token_text);
  log_info("open it on the screen that the camera looks at; Ctrl-C ends");
  if (!page.wait_for_page(stop.get())) {
    log_info("camera-timing: " + (page.ended().empty() ? "stopped" : page.ended()));
    return kFailed;
  }
  return measure(o, *input.source, page, stop, [&] { return page.description(); });
}

int run_with_lamp(const TimingOptions& o) {
  const UniqueFd stop = termination_fd();
  Bench bench = o.port == "sim" ? simulated_bench(o.sensor, o.source, o.fast)
                                : board_bench(o.sensor, o.source, o.port, o.fast);
  if (!bench.lamp) return kFailed;
  check_size(bench.input);
  log_info("source: " + bench.input.source->format().description);
  Processing processing(bench.input.sensor);

  CameraTimingOptions options;
  options.seconds = o.seconds;
  options.process = [&](Frame& frame) { processing.take(frame); };
  options.stopped = [&] { return termination_requested(); };
  options.stop_fd = stop.get();
  options.say = [](const std::string& line) { log_info(line); };
  const CameraTimingMeasurement measured =
      measure_camera_timing(*bench.input.source, *bench.lamp, options);
  if (!measured.refusal.empty()) {
    log_info((measured.failed ? "camera-timing: " : "camera-timing: nothing can be told: ") +
             measured.refusal);
    return kFailed;
  }
  if (processing.held() == 0)
    log_info(
        "the tags were not held while the LED was steady: the processing time is that of looking "
        "for them");
  const CameraTimingSetting setting{
      bench.input.source->format().description, bench.lamp_description, processing.output(),
      std::chrono::duration<double>(bench.input.source->format().period).count()};
  print(o, report_text(measured, setting), report_json(measured, setting));
  return kDone;
}

int measure_camera(const TimingOptions& o) {
  const bool screen = o.screen_given.count() > 0;
  if (!screen && o.port.empty())
    throw ConfigError(
        "camera-timing: needs a light: --port PORT for a board's LED, --port sim or --screen");
  if (screen) check_screen(o);
  if (!o.json.empty() && o.json != "-") check_report_file(o.json);
  return screen ? run_with_screen(o) : run_with_lamp(o);
}

}  // namespace

void camera_timing_command(command_line::Command program) {
  const auto o = std::make_shared<TimingOptions>();
  auto verb = program.add_subcommand("camera-timing",
                                     "measure the camera with the LED: true frame rate, latency, "
                                     "jitter, read-out, stale and missing frames");
  verb.footer(
      "With a board, its LED lights the picture: steadily for 3 s, not at all for 1 s, then in a\n"
      "pattern. Hands off, and little light from elsewhere. Without a board, --screen shows a "
      "window\n"
      "that flips between black and white, for the camera to look at; that tells frame rate and\n"
      "latency alone, the screen's own latency included. --screen web is the same as a page, for "
      "a\n"
      "phone or a tablet before the camera. Without any of them:\n"
      "  tagwrench camera-timing --source sim:tests/sim/scenarios/camera_timing.yaml --port sim "
      "--fast");
  verb.add_option("--source", o->source, "the camera: v4l2:/dev/videoN, sim or sim:SCENARIO.yaml")
      .required();
  auto port = verb.add_option(
      "--port", o->port,
      "the board: its serial port, usb:VENDOR:PRODUCT, or sim for the simulated lamp");
  o->screen_given = verb.add_option("--screen", o->screen,
                                    "a screen instead of a board's LED: window (as without a "
                                    "value), or web[:ADDRESS:PORT], a page for any browser")
                        .expected(0, 1)
                        .excludes(port);
  verb.add_option("--web-token", o->web_token,
                  "file with the token that the page needs, so that other computers may open it; "
                  "made if it is not there")
      .needs(o->screen_given);
  verb.add_option("--sensor", o->sensor, "sensor.yaml of this sensor");
  verb.add_option("--seconds", o->seconds, "length of the pattern")
      .check(command_line::number(
          kMin, kMax, fmt::format("a number of seconds from {:g} to {:g}", kMin, kMax), "SECONDS"))
      .capture_default_str();
  verb.add_option("--json", o->json,
                  "write the report as JSON to this file too; - is standard output");
  verb.add_flag("--fast", o->fast, "the simulated sensor runs as fast as it can");
  verb.runs([o] { return measure_camera(*o); });
}

}  // namespace tagwrench
