// A hand before one of two tags while the platform moves: the other one carries the pose, less
// well, and the covariance says how well.
#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <string>
#include <vector>

#include "host/app/scenario_config.h"
#include "host/source/simulator/simulator_source.h"
#include "host/tracker/tracker.h"
#include "tests/sim/sensor_geometry.h"

namespace tagwrench::test {
namespace {

constexpr int kSeeds = 2;
constexpr int kFrames = 150;
constexpr double kHandComes = 2.6;     // s
constexpr double kBandwidth_hz = 2;    // of the motion
constexpr double kPrintError = 0.005;  // as in consistency_test.cpp

/// How far a tag is covered.
enum Cover { wholly, partly, not_at_all, kCovers };
constexpr const char* kCoverNames[] = {"wholly", "partly", "not"};

struct Score {
  int frames = 0, ok = 0, lost = 0, one_tag = 0;
  std::vector<double> squares;  ///< normalised errors squared of ok frames
  double worst = 0;             ///< error on any axis, standard deviations
  int wrong = 0;                ///< beyond five of them, and beyond what anybody would feel

  void add(const Track& track, const Vector6& truth) {
    ++frames;
    lost += track.status == Status::lost ? 1 : 0;
    if (track.status != Status::ok) return;
    ++ok;
    one_tag += track.tags_held == 1 ? 1 : 0;
    const Vector6 error = track.displacement - truth;
    squares.push_back(error.dot(track.covariance.ldlt().solve(error)));
    const Vector6 felt =
        (Vector6() << 3e-6, 3e-6, 12e-6, 0.6e-3, 0.6e-3, 0.6e-3).finished();  // hard_run.h
    for (int axis = 0; axis < 6; ++axis) {
      const double sigmas = std::abs(error[axis]) / std::sqrt(track.covariance(axis, axis));
      worst = std::max(worst, sigmas);
      wrong += sigmas > 5 && std::abs(error[axis]) > felt[axis] ? 1 : 0;
    }
  }
  double ok_share() const { return static_cast<double>(ok) / std::max(1, frames); }
  double median_square() const {
    std::vector<double> sorted = squares;
    std::sort(sorted.begin(), sorted.end());
    return sorted.empty() ? 0 : sorted[sorted.size() / 2];
  }
};

/// Lies over one half of the image, or passes over one tag from left to right.
sim::Occluder hand_over(int tag, bool passing) {
  const double side = tag == 0 ? -1 : 1;
  sim::Occluder hand;
  hand.when = {kHandComes, 100, 0};
  hand.width_px = 300;
  hand.direction = M_PI / 2;
  hand.aim_px = {0, side * 150};
  if (!passing) return hand;
  hand.when = {kHandComes, 3, 3};
  hand.shape = sim::OccluderShape::disc;
  hand.direction = 0;
  hand.speed_px_per_s = 220;
  hand.aim_px = {0, side * 160};
  return hand;
}

class CoveredTag : public testing::TestWithParam<const char*> {};

TEST_P(CoveredTag, IsDoneWithoutAndTheSigmasSaySo) {
  Score scores[kCovers];
  for (int seed = 1; seed <= kSeeds; ++seed) {
    sim::Scenario scenario =
        load_scenario(std::string(TAGWRENCH_SCENARIOS) + "/" + GetParam() + ".yaml");
    scenario.seed = static_cast<std::uint64_t>(seed);
    scenario.target.print_error = kPrintError;
    scenario.trajectory.bandwidth = kBandwidth_hz;
    const SensorConfig sensor =
        calibrated(parse_sensor(sim::sensor_yaml(scenario), "the simulated sensor"), scenario);
    for (const auto& [tag, passing] :
         {std::pair(0, false), std::pair(1, false), std::pair(0, true), std::pair(1, true)}) {
      scenario.disturbances.occluders = {hand_over(tag, passing)};
      Tracker tracker(sensor.camera, sensor.target, sensor.rest);
      SimulatorSource source(scenario, /*live=*/false);
      for (int i = 0; i < kFrames; ++i) {
        Frame frame;
        source.read(frame);
        const Track track = tracker.track(frame);
        const sim::Truth& truth = source.truth();
        if (std::chrono::duration<double>(truth.time).count() < kHandComes + 0.1) continue;
        const auto [least, most] = std::minmax(truth.visible[0], truth.visible[1]);
        const Cover cover = most > 0.95 && least < 0.02   ? wholly
                            : most > 0.95 && least > 0.98 ? not_at_all
                                                          : partly;
        scores[cover].add(track, truth.exposed_displacement);
      }
    }
  }
  for (int cover = 0; cover < kCovers; ++cover) {
    const Score& score = scores[cover];
    std::printf(
        "%-9s %-6s covered: ok %3d of %3d, lost %d, by one tag %3d; worst %.1f sigma, "
        "median of the normalised error squared %.2f\n",
        GetParam(), kCoverNames[cover], score.ok, score.frames, score.lost, score.one_tag,
        score.worst, score.median_square());
    EXPECT_EQ(score.lost, 0) << kCoverNames[cover];
    EXPECT_EQ(score.wrong, 0) << kCoverNames[cover];
  }
  EXPECT_GE(scores[wholly].frames, 100);
  EXPECT_EQ(scores[wholly].one_tag, scores[wholly].ok);
  EXPECT_GE(scores[wholly].ok_share(), 0.95);
  EXPECT_LT(scores[wholly].worst, 5);
  EXPECT_GT(scores[wholly].median_square(), 4.5);
  EXPECT_LT(scores[wholly].median_square(), 7.5);
  EXPECT_GE(scores[partly].ok_share(), 0.9);
  EXPECT_EQ(scores[not_at_all].one_tag, 0);
}

INSTANTIATE_TEST_SUITE_P(Scenarios, CoveredTag, testing::Values("clean", "realistic"),
                         [](const auto& param) { return std::string(param.param); });

}  // namespace
}  // namespace tagwrench::test
