// The person at the simulated desk: a plan that can be counted against.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <vector>

#include "host/app/scenario_config.h"
#include "host/core/config_error.h"
#include "host/source/simulator/mechanics.h"
#include "host/source/simulator/trajectory.h"

namespace tagwrench::sim {
namespace {

Scenario at_the_desk(std::uint64_t seed = 1) {
  Scenario scenario = parse_scenario(
      "trajectory: {motion: desk, rest_s: 2}\ndesk: {length_s: 600, gesture_share: 0.3}\n", "desk");
  scenario.seed = seed;
  return scenario;
}

TEST(DeskUse, OneActFollowsAnotherAndGesturesComeFromRest) {
  const DeskUse use(at_the_desk());
  std::array<int, 10> count{};
  double end = 0;
  for (std::size_t i = 0; i < use.acts().size(); ++i) {
    const DeskAct& act = use.acts()[i];
    EXPECT_EQ(act.begin, end);
    EXPECT_GT(act.end, act.begin);
    end = act.end;
    ++count[static_cast<std::size_t>(act.what)];
    if (!is_gesture(act.what)) continue;
    EXPECT_EQ(use.acts()[i - 1].what, DeskDoing::rest);
    EXPECT_GE(act.begin - use.acts()[i - 1].begin, 0.5) << "s";
  }
  for (const int made : count) EXPECT_GT(made, 0);
}

TEST(DeskUse, AnswersAlikeInWhateverOrderItIsAsked) {
  DeskUse there(at_the_desk());
  DeskUse back(at_the_desk());
  std::vector<Vector6> loads;
  for (int i = 0; i < 60'000; ++i) loads.push_back(there.wrench(0.01 * i, Vector6::Zero()));
  for (int i = 60'000; i-- > 0;) {
    ASSERT_EQ(back.wrench(0.01 * i, Vector6::Zero()), loads[static_cast<std::size_t>(i)]) << i;
  }
}

TEST(DeskUse, PushesWithinTheAmplitudeAndRestsWithoutALoad) {
  const Scenario scenario = at_the_desk();
  DeskUse use(scenario);
  const Vector6 most = 1.3 * Vector6::Map(scenario.trajectory.amplitude.data());  // with tremor
  double largest = 0;
  for (double time = 0; time < 600; time += 2e-3) {
    const DeskDoing what = use.acts()[use.act_at(time)].what;
    const Vector6 load = use.wrench(time, Vector6::Zero());
    if (what == DeskDoing::rest || what == DeskDoing::knock) {
      ASSERT_EQ(load, Vector6::Zero().eval()) << time;
    } else if (what == DeskDoing::push) {
      ASSERT_TRUE((load.array().abs() <= most.array()).all()) << time << ": " << load.transpose();
      largest = std::max(largest, (load.array() / most.array()).abs().maxCoeff());
    }
  }
  EXPECT_GT(largest, 0.5);
}

TEST(DeskUse, ATapGoesDownAndATwistRightTurnsClockwiseSeenFromAbove) {
  DeskUse use(at_the_desk());
  for (const DeskAct& act : use.acts()) {
    const Vector6 load = use.wrench(0.5 * (act.begin + act.end), Vector6::Zero());
    if (act.what == DeskDoing::tap) {
      EXPECT_LT(load[2], -0.5);  // N; the camera looks up
    } else if (act.what == DeskDoing::twist_right) {
      EXPECT_LT(load[5], -3e-3);  // N m
    } else if (act.what == DeskDoing::twist_left) {
      EXPECT_GT(load[5], 3e-3);
    }
  }
}

TEST(DeskUse, RestWandersSlowlyAndBeginsAtZero) {
  Scenario scenario = at_the_desk();
  scenario.desk.wander = 0.01;
  DeskUse use(scenario);
  EXPECT_EQ(use.rest_change(0), Vector6::Zero().eval());
  const Matrix6 k = stiffness(scenario.mechanics);
  const Vector6 range = Vector6::Map(scenario.mechanics.range.data());
  double most = 0;
  for (double time = 0; time < 3600; time += 10) {
    const Vector6 part = (k * use.rest_change(time)).cwiseQuotient(range);
    most = std::max(most, part.cwiseAbs().maxCoeff());
  }
  EXPECT_LE(most, 0.01 + 1e-12);
  EXPECT_GT(most, 0.001);
}

TEST(DeskUse, SeedsMakeDifferentHours) {
  EXPECT_NE(DeskUse(at_the_desk(1)).acts()[5].end, DeskUse(at_the_desk(2)).acts()[5].end);
}

TEST(DeskUse, ScenarioKeysAreChecked) {
  EXPECT_THROW(parse_scenario("desk: {hours: 1}\n", "desk"), ConfigError);
  EXPECT_THROW(parse_scenario("desk: {gesture_share: 2}\n", "desk"), ConfigError);
  EXPECT_THROW(parse_scenario("desk: {length_s: -1}\n", "desk"), ConfigError);
}

}  // namespace
}  // namespace tagwrench::sim
