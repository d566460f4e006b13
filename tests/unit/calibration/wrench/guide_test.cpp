#include "host/calibration/wrench/guide.h"

#include <gtest/gtest.h>

#include <set>

#include "host/calibration/wrench/plan.h"
#include "tests/unit/calibration/wrench/wrench_bench.h"

namespace tagwrench::test {
namespace {

WrenchPlan plan_named(const std::string& name) { return parse_plan(plan_text(name), name); }

std::set<int> recorded(const WrenchGuide& guide) {
  std::set<int> steps;
  for (const StepRecord& record : guide.records()) steps.insert(record.step);
  return steps;
}

int first(const WrenchPlan& plan, StepKind kind) {
  for (std::size_t i = 0; i < plan.steps.size(); ++i) {
    if (plan.steps[i].kind == kind) return static_cast<int>(i);
  }
  return -1;
}

/// Load that the latest hold of a step shows, counted from the rest before it, N and N m.
Vector6 felt(const WrenchPlan& plan, const WrenchGuide& guide, int step) {
  Vector6 zero = Vector6::Zero();
  Vector6 out = Vector6::Zero();
  for (const StepRecord& record : guide.records()) {
    const Vector6 mean = mean_of(record).displacement;
    if (record.step == step) out = mean - zero;
    if (plan.steps[static_cast<std::size_t>(record.step)].kind == StepKind::rest) zero = mean;
  }
  return paper_stiffness() * out;
}

class EveryPlan : public testing::TestWithParam<const char*> {};

TEST_P(EveryPlan, IsDoneByItselfWhenThePersonDoesWhatIsAsked) {
  const WrenchPlan plan = plan_named(GetParam());
  WrenchGuide guide(plan, paper_options());
  HandsOn hands(plan, guide);
  hands.play();
  ASSERT_TRUE(guide.done()) << guide.live();
  EXPECT_FALSE(guide.failed()) << guide.failure();
  EXPECT_EQ(recorded(guide).size(), plan.steps.size());
  EXPECT_TRUE(guide.skipped().empty());
  EXPECT_TRUE(guide.coverage().complete());
  for (const GuideLine& line : hands.said)
    EXPECT_NE(line.kind, GuideLine::Kind::warning) << line.text;
}

INSTANTIATE_TEST_SUITE_P(Plans, EveryPlan,
                         testing::Values("paper", "six_orientations", "load_cell", "six_axis"),
                         [](const auto& plan) { return std::string(plan.param); });

TEST(WrenchGuide, AMassIsTakenOnlyWhenItNoLongerSwings) {
  const WrenchPlan plan = plan_named("paper");
  WrenchGuide guide(plan, paper_options());
  HandsOn hands(plan, guide);
  const int mass = first(plan, StepKind::mass);
  hands.play_until([&] { return recorded(guide).count(mass) > 0; });
  Observation known;
  set_hanging(plan, mass, Vector6::Zero(), known);
  const Vector6 error = (felt(plan, guide, mass) - known.wrench).cwiseQuotient(paper_range());
  EXPECT_LT(error.cwiseAbs().maxCoeff(), 0.005);  // of full load
}

TEST(WrenchGuide, ABumpBetweenTwoRestsRepeatsTheStepsBetween) {
  const WrenchPlan plan = plan_named("paper");
  WrenchGuide guide(plan, paper_options());
  HandsOn hands(plan, guide);
  const int mass = first(plan, StepKind::mass);
  bool once = false;
  hands.bump = [&](int step, int) {
    Vector6 change = Vector6::Zero();
    if (step == mass && !once) change << 40e-6, 0, 20e-6, 0, 1e-3, 0;  // m, rad
    once = once || step == mass;
    return change;
  };
  hands.play();
  ASSERT_TRUE(guide.done());
  EXPECT_FALSE(guide.failed()) << guide.failure();
  EXPECT_TRUE(hands.told("the sensor was bumped, or a tag has slipped"));
  EXPECT_TRUE(hands.told("to be done again: step 2 (150 g at the centre, standing)"));
  Observation known;
  set_hanging(plan, mass, Vector6::Zero(), known);
  const Vector6 error = (felt(plan, guide, mass) - known.wrench).cwiseQuotient(paper_range());
  EXPECT_LT(error.cwiseAbs().maxCoeff(), 0.005);
  // What came before the bump counts from another zero.
  EXPECT_NE(guide.records()[0].zero, guide.records()[1].zero);
  EXPECT_EQ(guide.records()[1].zero, guide.records()[2].zero);
}

TEST(WrenchGuide, AWeightThatPullsTheOtherWayIsRefused) {
  const WrenchPlan plan = plan_named("paper");
  WrenchGuide guide(plan, paper_options(/*attempts=*/0));
  HandsOn hands(plan, guide);
  hands.gravity_sign = -1;
  hands.play(60);
  EXPECT_EQ(recorded(guide), std::set<int>{0});
  EXPECT_TRUE(hands.told("gravity or the point of the plan is other than how it hangs"));
}

TEST(WrenchGuide, ATouchOfTheWeightThatStillHangsIsNotTheNextLoad) {
  const WrenchPlan plan = plan_named("six_orientations");  // a rest, the right bolt, the lower one
  WrenchGuide guide(plan, paper_options(/*attempts=*/0));
  // A small picture, whose noise hides a touch: a quarter of a percent of the range.
  const Matrix6 compliance = paper_stiffness().inverse();
  const Vector6 noise = 0.0025 * paper_range();
  double time = 0;
  const auto stand = [&](const Vector6& load, int frames) {
    for (int i = 0; i < frames; ++i) {
      Track track;
      track.status = Status::ok;
      track.displacement = compliance * load;
      track.covariance = compliance * noise.cwiseAbs2().asDiagonal() * compliance.transpose();
      guide.frame(time += 0.04, track);
    }
  };
  stand(Vector6::Zero(), 100);
  Observation right, lower;
  set_hanging(plan, 1, Vector6::Zero(), right);
  set_hanging(plan, 2, Vector6::Zero(), lower);
  stand(right.wrench, 100);
  ASSERT_EQ(recorded(guide), (std::set<int>{0, 1}));
  stand(right.wrench + 0.022 * paper_range()[0] * Vector6::Unit(0), 1);
  EXPECT_EQ(recorded(guide), (std::set<int>{0, 1}));
  for (GuideLine line; guide.next(line);)
    EXPECT_NE(line.kind, GuideLine::Kind::warning) << line.text;
  stand(lower.wrench, 100);
  EXPECT_EQ(recorded(guide).count(2), 1u);
}

TEST(WrenchGuide, ASensorThatLiesOtherwiseIsToldByThePlatformsOwnWeight) {
  const WrenchPlan plan = plan_named("six_orientations");
  WrenchPlan turned = plan;  // what the person does: the other side below
  turned.mountings[1].gravity = -turned.mountings[1].gravity;
  WrenchGuide guide(plan, paper_options(/*attempts=*/0));
  HandsOn hands(turned, guide);
  hands.play(200);
  EXPECT_EQ(recorded(guide), (std::set<int>{0, 1, 2, 3}));
  EXPECT_TRUE(hands.told("the sensor lies otherwise than the plan says"));
}

TEST(WrenchGuide, AStepThatIsSkippedSaysWhatItLeavesOpen) {
  WrenchPlan plan = plan_named("paper");
  WrenchGuide guide(plan, paper_options());
  HandsOn hands(plan, guide);
  while (!guide.done()) {
    const PlanStep& s = plan.steps[static_cast<std::size_t>(guide.asked())];
    const bool twists =
        s.kind == StepKind::mass && s.point > 0 && (s.mounting == 1 || s.mounting == 2);
    if (twists) {
      guide.skip();
    } else {
      const int ask = guide.asks();
      hands.play_until([&] { return guide.asks() != ask; });
    }
  }
  EXPECT_EQ(guide.skipped().size(), 4u);
  EXPECT_FALSE(guide.coverage().complete());
  EXPECT_TRUE(hands.told("no load twists about z: Mz")) << hands.said.size();
}

TEST(WrenchGuide, SkippingTheRestOfAMountingSkipsTheLoadsThatWouldCountFromIt) {
  const WrenchPlan plan = plan_named("six_orientations");
  WrenchGuide guide(plan, paper_options());
  guide.skip();
  EXPECT_EQ(guide.skipped(), (std::vector<int>{0, 1, 2}));
  EXPECT_EQ(guide.asked(), 3);
}

TEST(WrenchGuide, TheLatestStepCanBeDoneAgain) {
  const WrenchPlan plan = plan_named("six_orientations");
  WrenchGuide guide(plan, paper_options());
  HandsOn hands(plan, guide);
  hands.play_until([&] { return guide.records().size() == 2; });
  guide.redo();
  EXPECT_EQ(guide.records().size(), 1u);
  EXPECT_EQ(guide.asked(), 1);
  hands.play();
  EXPECT_TRUE(guide.done());
  EXPECT_EQ(recorded(guide).size(), plan.steps.size());
}

TEST(WrenchGuide, GoesOnWhereItWasStopped) {
  const WrenchPlan plan = plan_named("six_orientations");
  WrenchGuide stopped(plan, paper_options());
  HandsOn before(plan, stopped);
  before.play_until([&] { return stopped.records().size() == 6; });
  WrenchGuide guide(plan, paper_options());
  guide.resume(stopped.records(), stopped.skipped());
  EXPECT_EQ(guide.asked(), 4) << "the rest of the mounting first: it may have been moved";
  GuideLine why;
  ASSERT_TRUE(guide.next(why));
  EXPECT_NE(why.text.find("the rest of this position is taken again"), std::string::npos)
      << why.text;
  HandsOn hands(plan, guide);
  hands.play();
  ASSERT_TRUE(guide.done()) << guide.live();
  EXPECT_EQ(recorded(guide).size(), plan.steps.size());
  EXPECT_TRUE(guide.coverage().complete());
  for (std::size_t i = 1; i < guide.records().size(); ++i)
    EXPECT_GT(guide.records()[i].frames.front().time, guide.records()[i - 1].frames.back().time);
}

TEST(WrenchGuide, ALoadCellWiredTheWrongWayRoundEndsIt) {
  const WrenchPlan plan = plan_named("load_cell");
  WrenchGuide guide(plan, paper_options());
  HandsOn hands(plan, guide);
  hands.cell_sign = -1;
  hands.play();
  EXPECT_NE(guide.failure().find("swap its wires"), std::string::npos) << guide.failure();
}

TEST(WrenchGuide, AReferenceOnAnotherClockEndsIt) {
  const WrenchPlan plan = plan_named("load_cell");
  for (const double offset : {5.0, -5.0}) {  // s
    WrenchGuide guide(plan, paper_options());
    HandsOn hands(plan, guide);
    hands.reading_offset = offset;
    hands.play();
    EXPECT_NE(guide.failure().find("on another clock"), std::string::npos) << offset;
  }
}

TEST(WrenchGuide, ReadingsThatWaitedForTheFirstFrameAreNotOfAnotherClock) {
  const WrenchPlan plan = plan_named("load_cell");
  WrenchGuide guide(plan, paper_options());
  Track still;
  still.status = Status::ok;
  still.covariance = Matrix6::Identity() * 1e-14;
  ReferenceSample early;
  early.time = 10;
  guide.reading(early);
  guide.frame(15, still);
  guide.reading(early);
  EXPECT_FALSE(guide.failed()) << guide.failure();
}

TEST(WrenchGuide, AReferenceOfSomethingElseIsNotTaken) {
  const WrenchPlan plan = plan_named("load_cell");
  WrenchGuide guide(plan, paper_options(/*attempts=*/0));
  HandsOn hands(plan, guide);
  hands.unrelated = true;
  hands.play(100);
  EXPECT_EQ(recorded(guide), std::set<int>{0});
}

TEST(WrenchGuide, ASilentReferenceIsSaid) {
  const WrenchPlan plan = plan_named("six_axis");
  WrenchGuide guide(plan, paper_options(/*attempts=*/0));
  HandsOn hands(plan, guide);
  hands.silent_from = 115;
  hands.play(100);
  EXPECT_TRUE(hands.told("nothing comes from the reference"));
  EXPECT_EQ(recorded(guide), std::set<int>{0});
}

TEST(WrenchGuide, WhatWasLostFromSightIsNotSteady) {
  const WrenchPlan plan = plan_named("paper");
  WrenchGuide guide(plan, paper_options());
  Track lost;
  lost.status = Status::lost;
  Track still;
  still.status = Status::ok;
  still.covariance = Matrix6::Identity() * 1e-14;
  for (int i = 0; i < 200; ++i) guide.frame(1 + 0.04 * i, i % 10 == 9 ? lost : still);
  EXPECT_TRUE(guide.records().empty());
}

TEST(CoverageBar, HasFiveMarksPerAxisAndFillsThemByWhatIsMeasured) {
  WrenchCoverage coverage(paper_range());
  EXPECT_EQ(coverage_bar(coverage), "Fx ..... Fy ..... Fz ..... Mx ..... My ..... Mz .....");
  KnownLoad load;  // full load along x, known well: sigma about 0.02 of it, 93 % of the prior's 0.3
  load.wrench[0] = paper_range()[0];
  coverage.add(load);
  // Along z so poorly that a sigma of 0.18 is left: 40 %. 1/0.18^2 - 1/0.3^2 = 1/0.0506.
  load.wrench = Vector6::Unit(2) * paper_range()[2];
  load.covariance(2, 2) = 6 * 0.0506 * paper_range()[2] * paper_range()[2];  // N^2; a mean of six
  coverage.add(load);
  EXPECT_EQ(coverage_bar(coverage), "Fx ##### Fy ..... Fz ##... Mx ..... My ..... Mz .....");
}

}  // namespace
}  // namespace tagwrench::test
