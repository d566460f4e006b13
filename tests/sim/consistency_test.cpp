// Are the tracker's standard deviations true? Errors against the covariance that comes with them:
// scenario by geometry by motion.
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
#include "tests/sim/sensor_geometry.h"

namespace tagwrench::test {
namespace {

/// Every seed prints the tags anew and glues them anew.
constexpr int kSeeds = 6;
constexpr int kFrames = 80;  // judged, of each seed
/// Of prints that are off as a whole, where the scenario has none: what is claimed of planes and
/// scale is claimed of real ink.
constexpr double kPrintError = 0.005;

/// Of the normalised error squared; its mean is 6 when a covariance is true.
constexpr double kTrue = 7.5;
/// Places that are given to the last digit, of paper that stands off them: distance and shape then
/// contradict each other by a little, which only pictures without trouble show.
constexpr double kCurled = 9;
/// A camera's noise reduction over time drags edges behind, by up to a micrometre, and a focal
/// length that is wrong by half a percent tilts; neither shows in a picture, so that nothing counts
/// them.
constexpr double kDragged = 70;

enum class Geometry : std::uint8_t { learned_at_rest, given, calibrated };

constexpr const char* kGeometryNames[] = {"learned at rest", "given", "calibrated"};

struct Consistency {
  int frames = 0;
  int ok = 0;
  double squared = 0;                  ///< mean of e' C^-1 e: 6 when the covariance is true
  Vector6 per_axis = Vector6::Zero();  ///< mean of (e / sigma)^2: 1

  void add(const Consistency& other) {
    frames += other.frames;
    ok += other.ok;
    squared += other.squared;
    per_axis += other.per_axis;
  }
};

/// Sums, of the frames after the rest.
Consistency judge(const SensorConfig& sensor, const sim::Scenario& scenario) {
  Tracker tracker(sensor.camera, sensor.target, sensor.rest);
  SimulatorSource source(scenario, /*live=*/false);
  const int rest = std::max(sensor.rest.frames, static_cast<int>(scenario.trajectory.rest_time *
                                                                 scenario.camera.frame_rate));
  Consistency out;
  for (int i = 0; i < rest + kFrames; ++i) {
    Frame frame;
    source.read(frame);
    const Track track = tracker.track(frame);
    if (i < rest) continue;
    ++out.frames;
    if (track.status != Status::ok) continue;
    ++out.ok;
    const Vector6 error = track.displacement - source.truth().exposed_displacement;
    out.squared += error.dot(track.covariance.ldlt().solve(error));
    out.per_axis += error.cwiseAbs2().cwiseQuotient(track.covariance.diagonal());
  }
  return out;
}

struct Row {
  const char* scenario;
  Geometry geometry;
  double most_moved = kTrue;  ///< in motion; where it is more, the reason is named
  int seeds = kSeeds;
};

class Consistent : public testing::TestWithParam<Row> {};

TEST_P(Consistent, NormalisedErrorSquaredIsNearSix) {
  const auto [name, geometry, most_moved, seeds] = GetParam();
  Consistency still, moved;
  for (int seed = 1; seed <= seeds; ++seed) {
    sim::Scenario scenario = load_scenario(std::string(TAGWRENCH_SCENARIOS) + "/" + name + ".yaml");
    scenario.seed = static_cast<std::uint64_t>(seed);
    if (scenario.target.print_error == 0) scenario.target.print_error = kPrintError;
    SensorConfig sensor = parse_sensor(sim::sensor_yaml(scenario), "the simulated sensor");
    if (geometry == Geometry::given) sensor = with_true_places(sensor, scenario);
    if (geometry == Geometry::calibrated) sensor = calibrated(sensor, scenario);
    moved.add(judge(sensor, scenario));
    scenario.trajectory.motion = sim::Motion::rest;
    still.add(judge(sensor, scenario));
  }
  for (const auto& [motion, cell] : {std::pair("still", still), std::pair("moved", moved)}) {
    const double mean = cell.squared / std::max(1, cell.ok);
    std::printf("%-12s %-15s %s  ok %4d of %4d  nees %5.2f  (e/sigma)^2", name,
                kGeometryNames[static_cast<int>(geometry)], motion, cell.ok, cell.frames, mean);
    for (const double squares : cell.per_axis)
      std::printf(" %4.2f", squares / std::max(1, cell.ok));
    std::printf("\n");
    EXPECT_EQ(cell.ok, cell.frames) << motion;
    // Size and squareness of a print that was looked at only at rest are claimed as real ink has
    // them, which is worse than these: nothing to mend, but not near six.
    const bool wide = geometry == Geometry::learned_at_rest && cell.per_axis == moved.per_axis;
    EXPECT_GT(mean, wide ? 1.5 : 4.5) << motion;
    EXPECT_LT(mean, cell.per_axis == moved.per_axis ? most_moved : kTrue) << motion;
  }
}

INSTANTIATE_TEST_SUITE_P(
    Table, Consistent,
    testing::Values(Row{"clean", Geometry::learned_at_rest}, Row{"clean", Geometry::given, kCurled},
                    Row{"clean", Geometry::calibrated}, Row{"realistic", Geometry::learned_at_rest},
                    Row{"realistic", Geometry::given}, Row{"realistic", Geometry::calibrated},
                    Row{"webcam_cheap", Geometry::learned_at_rest, kDragged, 2},
                    Row{"webcam_cheap", Geometry::given, kDragged, 2},
                    Row{"webcam_good", Geometry::learned_at_rest, kDragged, 2},
                    Row{"webcam_good", Geometry::given, kDragged, 2},
                    Row{"phone", Geometry::learned_at_rest, kDragged, 2},
                    Row{"phone", Geometry::given, kDragged, 2}),
    [](const auto& param) {
      std::string geometry = kGeometryNames[static_cast<int>(param.param.geometry)];
      std::replace(geometry.begin(), geometry.end(), ' ', '_');
      return std::string(param.param.scenario) + "_" + geometry;
    });

}  // namespace
}  // namespace tagwrench::test
