// A fast-moving target under a rolling shutter: rows are exposed one after the other.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <string>

#include "host/app/scenario_config.h"
#include "host/sensor/sensor_config.h"
#include "host/source/simulator/simulator_source.h"
#include "host/tracker/tracker.h"

namespace tagwrench::test {
namespace {

constexpr int kJudged = 200;

TEST(RollingShutter, MeasuredReadoutTakesAwayMostOfTheErrorOfMotion) {
  constexpr double kLeft = 0.5;  // of the error
  constexpr int kMinBoth = 15;   // frames: most are doubtful without the readout time
  const sim::Scenario scenario =
      load_scenario(std::string(TAGWRENCH_SCENARIOS) + "/rolling_shutter.yaml");
  SensorConfig sensor = parse_sensor(sim::sensor_yaml(scenario), "the simulated sensor");
  sensor.camera.readout = 0;
  Tracker without(sensor.camera, sensor.target, sensor.rest);
  sensor.camera.readout = scenario.exposure.rolling_readout;
  Tracker with(sensor.camera, sensor.target, sensor.rest);
  SimulatorSource source(scenario, /*live=*/false);
  Vector6 off = Vector6::Zero(), on = Vector6::Zero();
  int ok = 0, both = 0;
  for (int i = 0; i < sensor.rest.frames + kJudged; ++i) {
    Frame frame;
    source.read(frame);
    const Track blind = without.track(frame);
    const Track seeing = with.track(frame);
    if (source.truth().displacement.head<3>().norm() < 20e-6) continue;  // not moving yet
    ok += seeing.status == Status::ok ? 1 : 0;
    if (blind.status != Status::ok || seeing.status != Status::ok) continue;
    ++both;
    off += (blind.displacement - source.truth().exposed_displacement).cwiseAbs2();
    on += (seeing.displacement - source.truth().exposed_displacement).cwiseAbs2();
  }
  std::printf("%d frames ok with the readout time, %d also without\n", ok, both);
  EXPECT_GT(ok, 4 * both) << "without the readout time a moving target is not to be believed";
  ASSERT_GE(both, kMinBoth);
  for (int axis = 0; axis < 6; ++axis) {
    const double unit = axis < 3 ? 1e6 : 1e3;
    std::printf("axis %d: rms %.3f without, %.3f with the readout time, um or mrad\n", axis,
                std::sqrt(off[axis] / both) * unit, std::sqrt(on[axis] / both) * unit);
    EXPECT_LT(std::sqrt(on[axis]), kLeft * std::sqrt(off[axis])) << "axis " << axis;
  }
}

}  // namespace
}  // namespace tagwrench::test
