// Someone else loads the simulated platform in place of its trajectory.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "host/source/simulator/bench.h"
#include "host/source/simulator/simulator_source.h"

namespace tagwrench {
namespace {

sim::Scenario small() {
  sim::Scenario s;
  s.camera.width_px = 160;
  s.camera.height_px = 120;
  s.camera.fx_px = s.camera.fy_px = 201;
  s.camera.cx_px = 79.5;
  s.camera.cy_px = 59.5;
  s.trajectory.rest_time = 0.1;
  s.exposure.rolling_readout = 8e-3;
  return s;
}

std::vector<std::uint8_t> picture(SimulatorSource& source) {
  Frame frame;
  EXPECT_EQ(source.read(frame), ReadStatus::frame);
  return {frame.image.pixels, frame.image.pixels + frame.image.width * frame.image.height};
}

/// Does what a scenario's trajectory would do.
class Played final : public sim::AppliedLoad {
 public:
  explicit Played(const sim::Scenario& s) : player_(s.trajectory, s.seed) {}
  Vector6 wrench(double time, const Vector6&) noexcept override {
    EXPECT_GT(time, newest_ - 1.0 / 25) << "further back than a frame period";
    newest_ = std::max(newest_, time);
    return player_.applied_wrench(time);
  }

 private:
  sim::TrajectoryPlayer player_;
  double newest_ = -1;
};

TEST(AppliedLoad, ThatDoesWhatTheTrajectoryDoesGivesTheSamePicturesBitByBit) {
  const sim::Scenario scenario = small();
  Played load(scenario);
  SimulatorSource plain(scenario, false), loaded(scenario, false, nullptr, &load);
  for (int i = 0; i < 20; ++i) {
    ASSERT_EQ(picture(plain), picture(loaded)) << i;
    EXPECT_EQ(plain.truth().wrench, loaded.truth().wrench);
    EXPECT_EQ(plain.truth().displacement, loaded.truth().displacement);
  }
  EXPECT_GT(plain.truth().wrench.norm(), 0.01) << "N; something happened";
}

TEST(AppliedLoad, TheBenchTakesThePlaceOfTheTrajectory) {
  sim::Scenario scenario = small();
  scenario.bench.perfect = true;
  sim::Bench bench(scenario.bench, scenario.seed);
  SimulatorSource source(scenario, false, nullptr, &bench);
  picture(source);
  EXPECT_EQ(source.truth().wrench, Vector6::Zero());
  bench.hang(0.05, {15e-3, 0, 6e-3});
  int frames = 0;
  for (; bench.busy(); ++frames) picture(source);
  EXPECT_NEAR(frames, 25 * (scenario.bench.times.reaction + scenario.bench.times.load), 2);
  for (int i = 0; i < 60; ++i) picture(source);
  const Vector6 wrench = source.truth().wrench;
  EXPECT_NEAR(wrench[2], -0.05 * scenario.bench.gravity, 1e-6);
  const Vector6 held = sim::stiffness(scenario.mechanics) * source.truth().displacement;
  EXPECT_LT((held - wrench).norm(), 1e-5 * wrench.norm());
}

TEST(AppliedLoad, ASlippedTagIsElsewhereInThePictureAndTheOtherIsNot) {
  sim::Scenario scenario = small();
  scenario.noise.read_counts = scenario.noise.shot_counts_per_count = 0;
  scenario.bench.faults.slip = 1;
  scenario.bench.faults.slip_tag = 1;
  scenario.bench.faults.slip_change = {200e-6, 0, 0};
  sim::Bench bench(scenario.bench, scenario.seed);
  SimulatorSource source(scenario, false, nullptr, &bench);
  const std::vector<std::uint8_t> before = picture(source);
  const std::vector<sim::PlacedTag> glued = source.truth().tags;
  bench.let_go();
  std::vector<std::uint8_t> after;
  for (int i = 0; i < 4; ++i) after = picture(source);
  const std::vector<sim::PlacedTag>& now = source.truth().tags;
  EXPECT_EQ(now[0].platform_T_tag.position, glued[0].platform_T_tag.position);
  const Eigen::Vector3d way = now[1].platform_T_tag.position - glued[1].platform_T_tag.position;
  EXPECT_LT((way - 200e-6 * glued[1].platform_T_tag.rotation.col(0)).norm(), 1e-12);
  EXPECT_EQ(source.truth().displacement, Vector6::Zero());
  // Tag 0 is in the upper half of the picture, tag 1 in the lower one.
  int upper = 0, lower = 0;
  for (std::size_t i = 0; i < before.size(); ++i) {
    const int change = std::abs(before[i] - after[i]);
    (i < before.size() / 2 - 160 * 4 ? upper : lower) += change > 10 ? 1 : 0;
  }
  EXPECT_EQ(upper, 0);
  EXPECT_GT(lower, 100);
}

TEST(AppliedLoad, AKnockShowsInThePictureAsADisplacementWithoutALoad) {
  sim::Scenario scenario = small();
  scenario.bench.faults.bump = 1;
  scenario.bench.faults.bump_change << 300e-6, 0, 0, 0, 0, 0;
  sim::Bench bench(scenario.bench, scenario.seed);
  SimulatorSource source(scenario, false, nullptr, &bench);
  const std::vector<std::uint8_t> before = picture(source);
  bench.let_go();
  std::vector<std::uint8_t> after;
  for (int i = 0; i < 4; ++i) after = picture(source);
  EXPECT_EQ(source.truth().displacement, scenario.bench.faults.bump_change);
  EXPECT_EQ(source.truth().wrench, Vector6::Zero());
  int changed = 0;
  for (std::size_t i = 0; i < before.size(); ++i) {
    changed += std::abs(before[i] - after[i]) > 10 ? 1 : 0;
  }
  EXPECT_GT(changed, 200);
}

}  // namespace
}  // namespace tagwrench
