// The tracker when things go wrong in front of the lens. TAGWRENCH_HARD_FRAMES=10000 makes the run
// over the hard scenario a long one; its table is printed in any case.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <string>

#include "host/app/scenario_config.h"
#include "host/sensor/sensor_config.h"
#include "host/source/simulator/simulator_source.h"
#include "host/tracker/tracker.h"
#include "tests/support/hard_run.h"

namespace tagwrench::test {
namespace {

constexpr int kHardFrames = 1200;

// One test, since each test is a process of its own and the run is the long part.
TEST(HardScenario, NoWrongOkNoLossInTheClearAndHeldAgainWithinTwoFrames) {
  const HardRun run = run_hard(load_scenario(std::string(TAGWRENCH_SCENARIOS) + "/hard.yaml"),
                               hard_frames(kHardFrames));
  std::printf("%s", report(run).c_str());
  EXPECT_EQ(run.wrong.size(), 0U);
  // A tracker that keeps silent is not right either, nor a scenario without trouble.
  EXPECT_GT(run.scores[kNoTrouble].ok, 0.95 * run.scores[kNoTrouble].frames);
  EXPECT_GT(run.recoveries, 0);
  for (const std::uint64_t sequence : run.lost_in_the_clear) {
    ADD_FAILURE() << "not ok at " << sequence << ", though a tag is wholly visible, undisturbed";
  }
  for (const std::uint64_t sequence : run.slow_recoveries) {
    ADD_FAILURE() << "not ok at " << sequence << ", two frames after the target was visible again";
  }
}

struct LightCase {
  const char* name;
  double start, length;  ///< s
};

// One after the other, on a sensor at rest.
constexpr LightCase kLightCases[] = {
    {"light x 0.6", 2, 1.5},          {"light x 1.4", 4.5, 1.5},   {"60 Hz flicker", 7, 2},
    {"50 Hz flicker, 25 fps", 10, 2}, {"light that turns", 13, 4}, {"drift to x 0.8", 18, 6},
};
constexpr int kLightFrames = 25 * 25;

sim::Scenario changing_light(double rolling_readout_s) {
  sim::Scenario s = load_scenario(std::string(TAGWRENCH_SCENARIOS) + "/realistic.yaml");
  s.trajectory.motion = sim::Motion::rest;
  s.exposure.time = 2e-3;
  s.exposure.rolling_readout = rolling_readout_s;
  const auto when = [](int i) {
    return sim::Occurrence{kLightCases[i].start, kLightCases[i].length, 0};
  };
  s.disturbances.light = {{when(0), 0.6, 0}, {when(1), 1.4, 0}, {when(5), 0.8, 3.0}};
  s.disturbances.flicker = {{when(2), 0.1, 60}, {when(3), 0.1, 50}};
  s.disturbances.turning_light = {{when(4), 0.3, 2.0, 0.2}};
  return s;
}

class ChangingLight : public testing::TestWithParam<double> {};

TEST_P(ChangingLight, LeavesTheZeroWhereItWas) {
  // Nobody feels these: 0.1 mN sideways, 4 mN along z, of a range of 0.9 N and 2.5 N.
  const double limit[6] = {0.3e-6, 0.3e-6, 1.5e-6, 0.1e-3, 0.1e-3, 0.1e-3};  // m, rad
  const sim::Scenario scenario = changing_light(GetParam());
  const SensorConfig sensor = parse_sensor(sim::sensor_yaml(scenario), "the simulated sensor");
  Tracker tracker(sensor.camera, sensor.target, sensor.rest);
  SimulatorSource source(scenario, /*live=*/false);

  struct Mean {
    Vector6 sum = Vector6::Zero();
    Vector6 variance = Vector6::Zero();
    int ok = 0, frames = 0;
    void add(const Track& track) {
      ++frames;
      if (track.status != Status::ok) return;
      sum += track.displacement;
      variance += track.covariance.diagonal();
      ++ok;
    }
    Vector6 value() const { return sum / std::max(ok, 1); }
  };
  constexpr int kCases = std::size(kLightCases);
  Mean before, during[kCases];
  for (int i = 0; i < kLightFrames; ++i) {
    Frame frame;
    source.read(frame);
    const Track track = tracker.track(frame);
    if (i <= sensor.rest.frames) continue;
    const double time = std::chrono::duration<double>(source.truth().time).count();
    if (time < kLightCases[0].start) before.add(track);
    for (int c = 0; c < kCases; ++c) {
      if (time > kLightCases[c].start && time < kLightCases[c].start + kLightCases[c].length)
        during[c].add(track);
    }
  }
  ASSERT_GT(before.ok, 15);
  for (int c = 0; c < kCases; ++c) {
    const Mean& m = during[c];
    EXPECT_EQ(m.ok, m.frames) << kLightCases[c].name;
    const Vector6 shift = m.value() - before.value();
    const Vector6 sigma = (m.variance / std::max(m.ok, 1)).cwiseSqrt();
    std::printf("%-22s ok %3d of %3d, zero moved", kLightCases[c].name, m.ok, m.frames);
    for (int axis = 0; axis < 6; ++axis) {
      EXPECT_LT(std::abs(shift[axis]), limit[axis]) << kLightCases[c].name << ", axis " << axis;
      std::printf(" %.3f", shift[axis] * (axis < 3 ? 1e6 : 1e3));
    }
    std::printf(" um, mrad = %.1f sigma at most\n",
                shift.cwiseAbs().cwiseQuotient(sigma).maxCoeff());
  }
}

INSTANTIATE_TEST_SUITE_P(Shutters, ChangingLight, testing::Values(0.0, 15e-3),
                         [](const auto& param) { return param.param > 0 ? "Rolling" : "Global"; });

}  // namespace
}  // namespace tagwrench::test
