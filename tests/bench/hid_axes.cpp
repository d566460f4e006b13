// One axis pushed at a time: what shows on the others, and what filters make of a push.
#include <fmt/format.h>

#include <array>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <string>
#include <vector>

#include "host/motion/profile_config.h"
#include "host/motion/shaping.h"
#include "host/sensor/sensor_config.h"
#include "host/source/simulator/simulator_source.h"
#include "host/tracker/tracker.h"
#include "host/wrench/estimate.h"
#include "tests/bench/hid_desk.h"
#include "tests/bench/hid_device.h"

namespace tagwrench::bench {
namespace {

constexpr std::array<const char*, 6> kPushed = {"fx", "fy", "fz", "mx", "my", "mz"};
const std::array<std::string, 6> kDeviceAxes = {"X", "Y", "Z", "RX", "RY", "RZ"};

struct Shown {
  std::array<double, 6> mean{};  ///< counts, while the push is whole
  std::array<double, 6> far{};   ///< largest, any time during it
};

/// A push along one axis with `share` of the device's full scale, in rendered pictures.
Shown push_one(int axis, double share, const std::vector<std::string>& profiles) {
  sim::Scenario scenario;
  scenario.seed = 11;
  scenario.trajectory.motion = sim::Motion::push;
  scenario.trajectory.axis = axis;
  const auto index = static_cast<std::size_t>(axis);
  const SensorConfig sensor = parse_sensor(sim::sensor_yaml(scenario), "the simulated sensor");
  scenario.trajectory.amplitude[index] = share * default_profile(sensor).shaping.full_scale[axis];
  SimulatorSource source(scenario, /*live=*/false);
  Tracker tracker(sensor.camera, sensor.target, sensor.rest);
  WrenchEstimator wrench(sensor.wrench);
  SimulatedDevice device(sensor, profiles);
  const double begin = scenario.trajectory.rest_time + 1.0;  // the ramp and its swing are over
  Shown shown;
  int moves = 0;
  for (double time = 0; time < begin + 2.0;) {
    Frame frame;
    source.read(frame);
    const Track track = tracker.track(frame);
    Sample sample{.sequence = frame.sequence, .capture_time = frame.capture_time};
    wrench.estimate(track, sample);
    time = std::chrono::duration<double>(source.truth().time).count();
    device.take(sample, wrench.noise(track), [&](TimePoint, const Counts6& counts) {
      if (time < begin) return;
      ++moves;
      for (std::size_t i = 0; i < 6; ++i) {
        shown.mean[i] += counts[i];
        shown.far[i] = std::max<double>(shown.far[i], std::abs(counts[i]));
      }
    });
  }
  for (double& mean : shown.mean) mean /= std::max(moves, 1);
  return shown;
}

/// Half of the full scale in `rise` seconds, as a raised cosine; when a filter's output has half of
/// that, interpolated between frames, s.
double half_way(const FilterOptions& filter, double fps, double rise) {
  ShapingOptions options;
  options.filter = filter;
  options.dead_zone.setConstant(1e-9);
  options.noise_sigmas = 0;
  options.fill = Fill::none;
  Shaping shaping(options);
  double before = 0;
  for (int frame = 0;; ++frame) {
    const double time = frame / fps;
    const double phase = std::clamp((time - 0.5) / rise, 0.0, 1.0);
    Sample sample{.capture_time = TimePoint(Duration(std::llround(1e9 * time))),
                  .status = Status::ok};
    sample.wrench[0] = 0.25 * (1 - std::cos(M_PI * phase)) * options.full_scale[0];
    shaping.shape(sample);
    if (sample.deflection[0] >= 0.25)
      return time - (sample.deflection[0] - 0.25) / (sample.deflection[0] - before) / fps;
    before = sample.deflection[0];
    if (time > 60) return std::numeric_limits<double>::quiet_NaN();
  }
}

}  // namespace

void bench_crosstalk(Table& table) {
  table.open(
      "crosstalk",
      {"One axis at a time pushed to 80 % of full deflection (280 counts) on the simulated "
       "published sensor,",
       "25 fps, rendered pictures, rest learned, springs as they are, no dominant axis. What "
       "a calibration leaves",
       "of cross-talk is in `./run bench wrench`. Target of our own: 1 % of full deflection."});
  struct Case {
    const char* name;
    std::vector<std::string> profiles;
  };
  for (const Case& c : {Case{"no profile", {}}, Case{"research (no dead zones)", {"research"}}}) {
    table.columns(std::string("counts, mean of the push, ") + c.name, kDeviceAxes);
    double worst = 0;
    for (int axis = 0; axis < 6; ++axis) {
      const Shown shown = push_one(axis, 0.8, c.profiles);
      table.figures(kPushed[static_cast<std::size_t>(axis)], shown.mean, 1);
      for (std::size_t i = 0; i < 6; ++i) {
        if (i != static_cast<std::size_t>(axis)) worst = std::max(worst, shown.far[i]);
      }
    }
    table.at_most(std::string(c.name) + ": most counts on an axis that is not pushed", worst, 3.5,
                  "counts");
  }
}

void bench_filter(Table& table) {
  table.open("filter",
             {"How much later a push passes its middle than unfiltered: to half of full deflection "
              "in 0.5 s and in 2 s.",
              "Target, brisk push: 16 ms, the interval between two reports of a wireless "
              "SpaceMouse."});
  table.columns("ms", {"25 fps", "30 fps", "60 fps", "120 fps", "", ""});
  const double none = std::numeric_limits<double>::quiet_NaN();
  constexpr std::array<double, 4> kRates = {25, 30, 60, 120};
  for (const double rise : {0.5, 2.0}) {
    for (const FilterKind kind : {FilterKind::one_euro, FilterKind::exponential}) {
      const bool standard = kind == FilterKind::one_euro;
      FilterOptions filter;
      filter.kind = kind;
      FilterOptions off;
      off.kind = FilterKind::none;
      std::array<double, 6> late{none, none, none, none, none, none};
      for (std::size_t i = 0; i < kRates.size(); ++i)
        late[i] = 1e3 * (half_way(filter, kRates[i], rise) - half_way(off, kRates[i], rise));
      const std::string name = fmt::format(
          "{}, {} s", standard ? "One Euro (default)" : "exponential (the paper's)", rise);
      table.figures(name, late, 1);
      if (standard && rise < 1) table.at_most(name, late, {16, 16, 16, 16, none, none}, 1);
    }
  }
}

}  // namespace tagwrench::bench
