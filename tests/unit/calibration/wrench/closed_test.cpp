// Does the calibration find the simulator's stiffness, and does it know how well?
#include <gtest/gtest.h>

#include <cmath>

#include "host/core/config_error.h"
#include "host/wrench/estimate.h"
#include "tests/unit/calibration/wrench/wrench_closed.h"

namespace tagwrench::test {
namespace {

constexpr int kLoads = 200;

/// Errors of a calibrated sensor under random loads, pooled over calibrations.
struct Score {
  Vector6 squares = Vector6::Zero();  ///< sum, share of range
  Vector6 inside = Vector6::Zero();   ///< number within 95 % intervals
  int count = 0;

  void add(ClosedBench& bench, WrenchModel model) {
    model.range.setConstant(1e9);
    WrenchEstimator estimator(model);
    const auto springs = bench.truth().ldlt();
    for (int i = 0; i < kLoads; ++i) {
      const Vector6 load = bench.random_load();
      Track track;
      track.status = Status::ok;
      track.displacement = bench.noisy(springs.solve(load));
      track.covariance = tracker_noise().cwiseAbs2().asDiagonal();
      Sample sample;
      estimator.estimate(track, sample);
      const Vector6 error = sample.wrench - load;
      squares += error.cwiseQuotient(paper_range()).cwiseAbs2();
      inside += (error.array().abs() <= 1.96 * sample.wrench_sigma.array()).cast<double>().matrix();
      ++count;
    }
  }
  Vector6 rms() const { return (squares / count).cwiseSqrt(); }
  Vector6 coverage() const { return inside / count; }
};

class EveryPlanClosed : public testing::TestWithParam<const char*> {};

TEST_P(EveryPlanClosed, FindsTheStiffnessAtAPerfectBench) {
  sim::BenchSettings perfect;
  perfect.perfect = true;
  ClosedBench bench(GetParam(), perfect, 1);
  bench.play();
  ASSERT_TRUE(bench.guide().done() && !bench.guide().failed()) << bench.guide().failure();
  EXPECT_TRUE(bench.guide().skipped().empty());
  Score score;
  WrenchData data = bench.data();
  // What a person would state of such a bench: nothing is off.
  for (Observation& o : data.observations) {
    o.common.clear();
    o.products.clear();
  }
  score.add(bench, bench.fit(data).model);
  EXPECT_LT(score.rms().maxCoeff(), 0.003) << score.rms().transpose();  // of range
}

// The bench's imperfections are drawn from what the plans state, and the tracker's axes are off by
// what the fit assumes, so that the share within 95 % intervals must be near 95 %.
TEST_P(EveryPlanClosed, ErrorsOfAnHonestBenchAreAsLargeAsStated) {
  constexpr std::uint64_t kSeeds = 6;
  Score score;
  std::size_t blocks = 0, rejected = 0;
  for (std::uint64_t seed = 1; seed <= kSeeds; ++seed) {
    ClosedBench bench(GetParam(), {}, seed);
    bench.play();
    ASSERT_TRUE(bench.guide().done() && !bench.guide().failed()) << bench.guide().failure();
    const WrenchFit fit = bench.fit(bench.data());
    score.add(bench, fit.model);
    blocks += fit.blocks.size();
    for (const BlockFit& block : fit.blocks) rejected += block.rejected ? 1 : 0;
    EXPECT_TRUE(fit.warnings.empty()) << seed << ": " << fit.warnings.front();
  }
  EXPECT_LT(score.rms().maxCoeff(), 0.01) << score.rms().transpose();  // of range
  EXPECT_GT(score.coverage().mean(), 0.90) << score.coverage().transpose();
  EXPECT_LT(score.coverage().mean(), 0.99) << score.coverage().transpose();
  EXPECT_LT(100 * rejected, blocks) << "healthy steps left out";
}

INSTANTIATE_TEST_SUITE_P(Plans, EveryPlanClosed,
                         testing::Values("paper", "six_orientations", "load_cell", "six_axis"),
                         [](const auto& plan) { return std::string(plan.param); });

/// The plan's step that hangs the nth mass.
int step_of_mass(const WrenchPlan& plan, int nth) {
  for (std::size_t i = 0; i < plan.steps.size(); ++i) {
    if (plan.steps[i].kind == StepKind::mass && --nth == 0) return static_cast<int>(i);
  }
  return -1;
}

struct WrongMass {
  const char* plan;
  std::uint64_t seed;
  int nth;
  double factor;
};

// Benches at which one wrong mass among few makes the others look wrong too, or the model.
TEST(WrenchClosed, AWrongMassIsFoundAmongTheOthersAndLeftOut) {
  for (const WrongMass& wrong :
       {WrongMass{"six_orientations", 4, 5, 2}, WrongMass{"six_orientations", 2, 5, 2},
        WrongMass{"six_orientations", 8, 5, 2}, WrongMass{"six_orientations", 1, 2, 2},
        WrongMass{"six_orientations", 11, 1, 2}, WrongMass{"six_orientations", 12, 10, 2},
        WrongMass{"six_orientations", 3, 7, 0.5}, WrongMass{"six_orientations", 2, 5, 1.3},
        WrongMass{"paper", 2, 1, 2}, WrongMass{"paper", 3, 6, 0.5}}) {
    const std::string name = std::string(wrong.plan) + ", mass " + std::to_string(wrong.nth) +
                             ", seed " + std::to_string(wrong.seed);
    sim::BenchSettings settings;
    settings.faults.wrong_mass = wrong.nth;
    settings.faults.wrong_mass_factor = wrong.factor;
    ClosedBench bench(wrong.plan, settings, wrong.seed);
    bench.play();
    ASSERT_TRUE(bench.guide().done() && !bench.guide().failed()) << bench.guide().failure();
    const WrenchFit fit = bench.fit(bench.data());
    int rejected = 0;
    for (const BlockFit& block : fit.blocks) {
      if (!block.rejected) continue;
      ++rejected;
      EXPECT_EQ(block.step, step_of_mass(bench.plan(), wrong.nth)) << name << block.remark;
      EXPECT_NEAR(block.load_ratio, wrong.factor, 0.1 * wrong.factor) << name;
    }
    EXPECT_EQ(rejected, 1) << name;
    EXPECT_EQ(fit.warnings.size(), 1u) << name << ": " << fit.warnings.back();
    Score score;
    score.add(bench, fit.model);
    EXPECT_LT(score.rms().maxCoeff(), 0.02) << name << score.rms().transpose();  // of range
  }
}

TEST(WrenchClosed, APointThatIsElsewhereThanThePlanSaysIsTold) {
  for (const std::uint64_t seed : {1, 2, 3}) {
    ClosedBench bench("six_orientations", {}, seed);
    bench.play();
    WrenchPlan plan = bench.plan();
    plan.points[1].position.z() += 0.010;
    const WrenchFit fit = bench.fit(collect(plan, bench.guide().records(), 0));
    bool told = false;
    for (const std::string& warning : fit.warnings) {
      told = told || warning.find("acts elsewhere: another point") != std::string::npos ||
             warning.find("place of the left bolt") != std::string::npos;
    }
    EXPECT_TRUE(told) << seed;
    Score score;
    score.add(bench, fit.model);
    EXPECT_LT(score.rms().maxCoeff(), 0.02) << score.rms().transpose();  // of range
  }
}

// Half of the plan hangs there, so that the other half might as well be wrong.
TEST(WrenchClosed, StepsThatContradictEachOtherAreToldWhereNobodyKnowsWhichAreWrong) {
  for (const std::uint64_t seed : {1, 2, 3, 4, 5, 6}) {
    ClosedBench bench("paper", {}, seed);
    bench.play();
    WrenchPlan plan = bench.plan();
    for (PlanPoint& point : plan.points) {
      if (point.name == "the centre") point.position.z() += 0.010;
    }
    try {
      EXPECT_FALSE(bench.fit(collect(plan, bench.guide().records(), 0)).warnings.empty()) << seed;
    } catch (const ConfigError& e) {
      EXPECT_NE(std::string(e.what()).find("contradict"), std::string::npos) << e.what();
    }
  }
}

TEST(WrenchClosed, APlanWithItsPointsMirroredIsRefused) {
  ClosedBench bench("six_orientations", {}, 1);
  bench.play();
  WrenchPlan plan = bench.plan();
  for (PlanPoint& point : plan.points) point.position.x() *= -1;
  try {
    bench.fit(collect(plan, bench.guide().records(), 0));
    FAIL() << "a calibration that means nothing";
  } catch (const ConfigError& e) {
    EXPECT_NE(std::string(e.what()).find("the steps contradict each other"), std::string::npos)
        << e.what();
  }
}

TEST(WrenchClosed, AnAxisThatNoPushReachesIsMarkedHoweverCloseToNothingItWas) {
  WrenchPlan plan = parse_plan(plan_text("load_cell"), "load_cell");
  std::erase_if(plan.steps, [&](const PlanStep& step) {
    return step.kind == StepKind::push &&
           plan.points[static_cast<std::size_t>(step.point)].name.find("corner") !=
               std::string::npos;
  });
  for (const std::uint64_t seed : {5, 6}) {
    ClosedBench bench(plan, {}, seed);
    bench.play();
    const WrenchFit fit = bench.fit(bench.data());
    EXPECT_EQ(fit.missing, std::vector<std::string>{"Mz"});
    EXPECT_EQ(fit.axis[5].state, AxisState::spring_model) << seed;
    EXPECT_EQ(fit.axis[5].reason, "no torque about z was applied");
    for (std::size_t i = 0; i < 5; ++i) EXPECT_EQ(fit.axis[i].state, AxisState::calibrated) << i;
  }
}

// Everything counts from the rests: none may hold the tail of the push before it.
TEST(WrenchClosed, RestsBetweenPushesAgree) {
  sim::BenchSettings perfect;
  perfect.perfect = true;
  ClosedBench bench("load_cell", perfect, 1);
  bench.play();
  std::vector<Vector6> rests;
  for (const StepRecord& record : bench.guide().records()) {
    if (bench.plan().steps[static_cast<std::size_t>(record.step)].kind != StepKind::rest) continue;
    Vector6 sum = Vector6::Zero();
    for (const auto& frame : record.frames) sum += frame.displacement;
    rests.push_back(bench.truth() * sum / static_cast<double>(record.frames.size()));
  }
  ASSERT_GE(rests.size(), 4u);
  for (const Vector6& rest : rests)
    EXPECT_LT(std::abs((rest - rests.front())[5]), 3e-6) << "N m about z";
}

TEST(WrenchClosed, ABumpIsRepeatedAndDoesNoHarm) {
  sim::BenchSettings settings;
  settings.faults.bump = 2;  // orders of the plan: hang, hang, let go, turn ...
  ClosedBench bench("six_orientations", settings, 1);
  bench.play();
  ASSERT_TRUE(bench.guide().done() && !bench.guide().failed()) << bench.guide().failure();
  EXPECT_TRUE(bench.told("the sensor was bumped"));
  Score score;
  score.add(bench, bench.fit(bench.data()).model);
  EXPECT_LT(score.rms().maxCoeff(), 0.03) << score.rms().transpose();  // of range
}

TEST(WrenchClosed, AnOverloadedCellIsNotBelieved) {
  sim::BenchSettings settings;
  settings.load_cell.range = 0.4;  // N
  ClosedBench bench("load_cell", settings, 1);
  bench.play(200);
  EXPECT_TRUE(bench.told("the reference was overloaded"));
}

TEST(WrenchClosed, ReferenceLagIsFoundWithinItsUncertaintyOfAMillisecond) {
  sim::BenchSettings settings;
  ClosedBench bench("load_cell", settings, 1);
  bench.play();
  const WrenchData data = bench.data();
  ASSERT_TRUE(data.lag.known);
  EXPECT_NEAR(data.lag.value, -settings.load_cell.lag, 2e-3);  // s: the platform's own is 1 ms
}

}  // namespace
}  // namespace tagwrench::test
