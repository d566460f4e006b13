#include "tests/bench/hid_desk.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <string>
#include <vector>

#include "host/app/scenario_config.h"
#include "host/sensor/sensor_config.h"
#include "host/source/simulator/simulator_source.h"
#include "tests/bench/hid_device.h"
#include "tests/bench/hid_figures.h"
#include "tests/support/desk_readings.h"

namespace tagwrench::bench {
namespace {

constexpr double kHour = 3600;    // s
constexpr double kSettled = 1.0;  // s after a touch from which on it is rest
constexpr double kAtOnce = 0.02;  // s; who lets go faster lets go at once
constexpr double kNoiseShare =
    6e-4;  // of the range, one standard deviation; twice that of pictures

double seconds_of(TimePoint time) {
  return std::chrono::duration<double>(time.time_since_epoch()).count();
}

struct DeskFigures {
  long moves_at_rest = 0;
  long counts_at_rest = 0;   ///< of these moves, how many were not zero
  std::vector<double> stop;  ///< s, from the finger's leaving to the first of lasting zeros
};

/// What the device shows, beside what the person does.
class DeskWatch {
 public:
  explicit DeskWatch(const sim::DeskUse& use) : use_(use) {}

  void move(double time, const Counts6& counts) {
    const std::size_t position = use_.act_at(time);
    if (position != position_) begin(position);
    const bool moves = std::any_of(counts.begin(), counts.end(), [](int c) { return c != 0; });
    const sim::DeskAct& act = use_.acts()[position];
    if (act.what != sim::DeskDoing::rest) {
      moved_ = moved_ || moves;
      return;
    }
    if (time - act.begin > kSettled) {
      ++figures_.moves_at_rest;
      figures_.counts_at_rest += moves ? 1 : 0;
    }
    if (moves) first_zero_ = -1;
    if (!moves && first_zero_ < 0) first_zero_ = time - act.begin;
  }
  const DeskFigures& figures() const { return figures_; }

 private:
  void begin(std::size_t position) {
    const std::vector<sim::DeskAct>& acts = use_.acts();
    const bool rested = acts[position_].what == sim::DeskDoing::rest;
    if (rested && let_go_ && first_zero_ >= 0) figures_.stop.push_back(first_zero_);
    const sim::DeskAct& last = acts[position_];
    let_go_ = !rested && moved_ && last.what == sim::DeskDoing::push && last.fall > 0 &&
              last.fall < kAtOnce;
    position_ = position;
    first_zero_ = -1;
    moved_ = false;
  }

  const sim::DeskUse& use_;
  std::size_t position_ = 0;
  bool moved_ = false;   ///< during this act
  bool let_go_ = false;  ///< before this rest
  double first_zero_ = -1;
  DeskFigures figures_;
};

/// Someone works for an hour at `fps` frames a second.
DeskFigures desk_hour(double fps, std::uint64_t seed) {
  sim::Scenario scenario = load_scenario(std::string(TAGWRENCH_SCENARIOS) + "/desk.yaml");
  scenario.seed = seed;
  const SensorConfig sensor = parse_sensor(sim::sensor_yaml(scenario), "the simulated sensor");
  test::DeskReadingOptions options;
  options.fps = fps;
  options.noise = kNoiseShare * sensor.wrench.range;
  test::DeskReadings readings(scenario, options);
  SimulatedDevice device(sensor);
  DeskWatch watch(readings.use());
  double time = 0;
  while (time < kHour) {
    Sample sample = readings.next();
    time = seconds_of(sample.capture_time);
    device.take(sample, options.noise,
                [&](TimePoint at, const Counts6& counts) { watch.move(seconds_of(at), counts); });
  }
  return watch.figures();
}

}  // namespace

void bench_rest(Table& table) {
  table.open("rest",
             {"An hour of simulated desk work (tests/sim/scenarios/desk.yaml: pushes, taps, a hand "
              "laid on, knocks,",
              "creep, a rest that wanders), read with noise of 0.06 % of the range; 125 moves a "
              "second, no profile.",
              "At rest: from 1 s after the last touch. Target: none."});
  for (const double fps : {25.0, 60.0, 120.0}) {
    const DeskFigures figures = desk_hour(fps, 2);
    table.at_most(
        fmt::format("{:.0f} fps: of {} moves at rest, not zero", fps, figures.moves_at_rest),
        static_cast<double>(figures.counts_at_rest), 0, "");
  }
}

void bench_stop(Table& table) {
  constexpr int kHours = 5;
  table.open("stop",
             {fmt::format("{} such hours: pushes let go within 20 ms, from the finger's leaving to "
                          "the first of lasting zeros.",
                          kHours),
              "The platform swings at 26 Hz then; what is not told from a push counts as motion. "
              "Time in the camera and",
              "on the wire comes on top (below). Targets of our own: two frames; and 80 ms, after "
              "which robot programs",
              "take a device for dead."});
  for (const double fps : {25.0, 30.0, 60.0, 120.0}) {
    std::vector<double> stop_ms;
    for (std::uint64_t seed = 1; seed <= kHours; ++seed) {
      for (const double s : desk_hour(fps, seed).stop) stop_ms.push_back(1e3 * s);
    }
    table.line(
        fmt::format("{:.0f} fps: median {:.0f} ms, p90 {:.0f}, p99 {:.0f}, worst {:.0f} of {}", fps,
                    median(stop_ms), quantile(stop_ms, 0.9), quantile(stop_ms, 0.99), most(stop_ms),
                    stop_ms.size()));
    table.at_most(fmt::format("{:.0f} fps: median, in frames", fps), median(stop_ms) * fps * 1e-3,
                  2, "frames");
    table.at_most(fmt::format("{:.0f} fps: p99", fps), quantile(stop_ms, 0.99), 80, "ms");
  }
}

}  // namespace tagwrench::bench
