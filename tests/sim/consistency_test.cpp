// Are the tracker's standard deviations true? Errors against the covariance that comes with them.
#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <string>

#include "host/app/scenario_config.h"
#include "host/sensor/sensor_config.h"
#include "host/source/simulator/simulator_source.h"
#include "host/tracker/tracker.h"

namespace tagwrench::test {
namespace {

/// Every seed glues the tags anew, and its tracker learns anew where they sit.
constexpr int kSeeds = 8;
constexpr int kFrames = 80;  // judged, of each seed

struct Consistency {
  int frames = 0;
  int ok = 0;
  double squared = 0;                        ///< mean of e' C^-1 e: 6 when the covariance is true
  Vector6 per_axis = Vector6::Zero();        ///< mean of (e / sigma)^2: 1
  Vector6 square_error = Vector6::Zero();    ///< mean, m^2 and rad^2
  Vector6 square_claimed = Vector6::Zero();  ///< mean variance
};

Consistency judge(const sim::Scenario& scenario) {
  const SensorConfig sensor = parse_sensor(sim::sensor_yaml(scenario), "the simulated sensor");
  Tracker tracker(sensor.camera, sensor.target, sensor.rest);
  SimulatorSource source(scenario, /*live=*/false);
  Consistency out;
  for (int i = 0; i < sensor.rest.frames + kFrames; ++i) {
    Frame frame;
    source.read(frame);
    const Track track = tracker.track(frame);
    if (i < sensor.rest.frames) continue;
    ++out.frames;
    if (track.status != Status::ok) continue;
    ++out.ok;
    const Vector6 error = track.displacement - source.truth().exposed_displacement;
    const Vector6 variance = track.covariance.diagonal();
    out.squared += error.dot(track.covariance.ldlt().solve(error));
    out.per_axis += error.cwiseAbs2().cwiseQuotient(variance);
    out.square_error += error.cwiseAbs2();
    out.square_claimed += variance;
  }
  const double count = std::max(1, out.ok);
  out.squared /= count;
  for (Vector6* sum : {&out.per_axis, &out.square_error, &out.square_claimed}) *sum /= count;
  return out;
}

void print(int seed, const Consistency& c) {
  std::printf("seed %2d  ok %3d of %3d  e'C^-1 e %6.2f  (e/sigma)^2", seed, c.ok, c.frames,
              c.squared);
  for (int a = 0; a < 6; ++a) std::printf(" %5.2f", c.per_axis[a]);
  std::printf("  rms");
  for (int a = 0; a < 6; ++a)
    std::printf(" %.3f", std::sqrt(c.square_error[a]) * (a < 3 ? 1e6 : 1e3));
  std::printf(" claimed");
  for (int a = 0; a < 6; ++a)
    std::printf(" %.3f", std::sqrt(c.square_claimed[a]) * (a < 3 ? 1e6 : 1e3));
  std::printf(" um mrad\n");
}

class Consistent : public testing::TestWithParam<const char*> {};

TEST_P(Consistent, NormalisedErrorSquaredIsNearSix) {
  double sum = 0;
  int ok = 0;
  for (int seed = 1; seed <= kSeeds; ++seed) {
    sim::Scenario scenario =
        load_scenario(std::string(TAGWRENCH_SCENARIOS) + "/" + GetParam() + ".yaml");
    scenario.seed = static_cast<std::uint64_t>(seed);
    const Consistency c = judge(scenario);
    print(seed, c);
    EXPECT_EQ(c.ok, c.frames) << "seed " << seed;
    sum += c.squared * c.ok;
    ok += c.ok;
  }
  const double mean = sum / std::max(1, ok);
  std::printf("%s: mean normalised error squared %.2f over %d frames\n", GetParam(), mean, ok);
  // Of what is claimed for prints that are off as a whole nothing is needed here.
  EXPECT_GT(mean, 3);
  EXPECT_LT(mean, 7.5);
}

INSTANTIATE_TEST_SUITE_P(Scenarios, Consistent, testing::Values("clean", "realistic"),
                         [](const auto& param) { return std::string(param.param); });

}  // namespace
}  // namespace tagwrench::test
