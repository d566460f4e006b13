#include "host/calibration/wrench/plan.h"

#include <gtest/gtest.h>

#include <fstream>
#include <iterator>
#include <set>

#include "host/core/config_error.h"
#include "tests/unit/calibration/wrench/wrench_bench.h"

namespace tagwrench::test {
namespace {

const char* const kPlan = R"(about: a test
reference: masses
points:
  - {name: centre, position_mm: [0, 0, 6]}
  - {name: right, position_mm: [15, 0, 6], sigma_mm: 0.1}
mountings:
  - name: standing
    gravity: [0, 0, -2]
    say: stand it up
    steps:
      - {do: rest}
      - {do: mass, mass_g: 50, at: right}
)";

std::string with(std::string text, const std::string& old, const std::string& fresh) {
  return text.replace(text.find(old), old.size(), fresh);
}

std::string refusal(const std::string& text) {
  try {
    parse_plan(text, "p.yaml");
  } catch (const ConfigError& e) {
    return e.what();
  }
  return "";
}

TEST(WrenchPlan, IsReadInSiUnits) {
  const WrenchPlan plan = parse_plan(kPlan, "p.yaml");
  ASSERT_EQ(plan.steps.size(), 2u);
  EXPECT_EQ(plan.steps[1].kind, StepKind::mass);
  EXPECT_DOUBLE_EQ(plan.steps[1].mass, 0.050);
  EXPECT_EQ(plan.steps[1].point, 1);
  EXPECT_NEAR(plan.points[1].sigma, 0.1e-3, 1e-12);
  EXPECT_EQ(plan.mountings[0].gravity, -Eigen::Vector3d::UnitZ()) << "a direction has length 1";
}

TEST(WrenchPlan, MistakesAreNamedWithTheirLine) {
  EXPECT_NE(refusal(with(kPlan, "mass_g: 50", "mass: 50")).find("p.yaml:12: "), std::string::npos);
  EXPECT_NE(refusal(with(kPlan, "at: right", "at: rihgt")).find("p.yaml:12: "), std::string::npos);
  EXPECT_NE(refusal(with(kPlan, "at: right", "at: rihgt")).find("centre, right"),
            std::string::npos);
  EXPECT_NE(refusal(with(kPlan, "[0, 0, -2]", "[0, 0, 0]")).find("p.yaml:8: "), std::string::npos);
  EXPECT_NE(refusal(with(kPlan, "mass_g: 50", "mass_g: -5")).find("p.yaml:12: "),
            std::string::npos);
  EXPECT_NE(refusal(with(kPlan, "      - {do: rest}\n", "")).find("must begin with {do: rest}"),
            std::string::npos);
  EXPECT_NE(refusal(with(kPlan, "reference: masses", "reference: load_cell")).find("p.yaml:12: "),
            std::string::npos)
      << "masses are no steps of a load cell's plan";
  EXPECT_NE(refusal(with(kPlan, "about:", "abuot:")).find("p.yaml:1: "), std::string::npos);
  EXPECT_NE(refusal(with(kPlan, "name: right", "name: centre")).find("p.yaml:5: "),
            std::string::npos);
}

TEST(WrenchPlan, EveryReadyPlanReachesAllSixDimensions) {
  std::set<std::string> names;
  for (const ReadyPlan& ready : ready_plans()) {
    const WrenchPlan plan = parse_plan(ready.text, ready.name);
    names.insert(ready.name);
    EXPECT_TRUE(coverage_of(plan, paper_range()).complete()) << ready.name;
    EXPECT_LT(coverage_of(plan, paper_range()).sigma().maxCoeff(), 0.05) << ready.name;
    EXPECT_FALSE(plan.about.empty());
    EXPECT_GT(plan.minutes, 0) << ready.name;
  }
  EXPECT_EQ(names, (std::set<std::string>{"paper", "six_orientations", "load_cell", "six_axis"}));
}

TEST(WrenchPlan, MinutesInTheDocumentAreThoseOfThePlans) {
  std::ifstream file(TAGWRENCH_SOURCE_DIR "/docs/calibration.md");
  const std::string readme(std::istreambuf_iterator<char>(file), {});
  const std::size_t table = readme.find("| plan | what you need | minutes |");
  for (const ReadyPlan& ready : ready_plans()) {
    const std::size_t row = readme.find("| `" + ready.name + "` |", table);
    ASSERT_NE(row, std::string::npos) << ready.name;
    const std::string line = readme.substr(row, readme.find('\n', row) - row);
    const std::string minutes =
        "| " + std::to_string(parse_plan(ready.text, ready.name).minutes) + " |";
    EXPECT_NE(line.find(minutes), std::string::npos) << line << ": not " << minutes;
  }
}

TEST(WrenchPlan, AMissingDimensionIsNamed) {
  // Without the bolts beside the middle, nothing twists about z.
  WrenchPlan plan = parse_plan(plan_text("paper"), "paper");
  std::erase_if(plan.steps, [&](const PlanStep& s) {
    return s.kind == StepKind::mass && s.point > 0 &&
           std::abs(plan.mountings[static_cast<std::size_t>(s.mounting)].gravity.z()) < 0.5;
  });
  const std::vector<std::string> missing = coverage_of(plan, paper_range()).missing();
  ASSERT_EQ(missing.size(), 1u);
  EXPECT_EQ(missing[0], "no load twists about z: Mz");
}

TEST(WrenchPlan, LoadsThatAlwaysComeTogetherAreNamedTogether) {
  // Pulls along x at one height bring Fx and My in one proportion; nothing else brings either.
  WrenchPlan plan = parse_plan(plan_text("paper"), "paper");
  std::erase_if(plan.steps, [&](const PlanStep& s) {
    return s.kind == StepKind::mass && (s.point == 1 || s.point == 2) &&
           plan.mountings[static_cast<std::size_t>(s.mounting)].gravity.z() > 0.5;
  });
  for (PlanPoint& point : plan.points) point.position.z() = 15e-3;
  const std::vector<std::string> missing = coverage_of(plan, paper_range()).missing();
  ASSERT_EQ(missing.size(), 1u);
  EXPECT_NE(missing[0].find("Fx and My"), std::string::npos) << missing[0];
}

TEST(WrenchLoad, AHangingMassPullsAtThePointWhereItIsNow) {
  const WrenchPlan plan = parse_plan(kPlan, "p.yaml");
  Observation observation;
  Vector6 displacement = Vector6::Zero();
  displacement[1] = 2e-3;                  // m
  displacement[5] = std::numbers::pi / 2;  // the right bolt has come to where y was
  set_hanging(plan, 1, displacement, observation);
  const double weight = 0.050 * 9.80665;  // N, along -z
  EXPECT_NEAR(observation.wrench[2], -weight, 1e-12);
  EXPECT_NEAR(observation.wrench[3], -weight * 17e-3, 1e-9);  // N m: y F
  EXPECT_NEAR(observation.wrench[4], 0, 1e-9);
}

TEST(WrenchLoad, ASixAxisReferenceUnderneathIsMovedToThePlatform) {
  WrenchPlan plan = parse_plan(plan_text("six_axis"), "six_axis");
  Vector6 value = Vector6::Zero();
  value[0] = 1;  // N along x at the reference's origin, 51 mm below
  const Vector6 w = six_axis_wrench(plan, value);
  EXPECT_NEAR(w[0], 1, 1e-12);
  EXPECT_NEAR(w[4], -0.051, 1e-12);  // N m: z F = -51 mm x 1 N
  plan.reference_sign = -1;
  EXPECT_NEAR(six_axis_wrench(plan, value)[0], -1, 1e-12);
}

TEST(WrenchCoverage, TheStepThatBringsWhatIsMissingTellsMost) {
  const WrenchPlan plan = parse_plan(plan_text("paper"), "paper");
  WrenchCoverage coverage(paper_range());
  for (std::size_t i = 0; i < plan.steps.size(); ++i) {
    const PlanStep& s = plan.steps[i];
    const bool twists =
        s.kind == StepKind::mass && s.point > 0 && (s.mounting == 1 || s.mounting == 2);
    if (!twists) coverage.add(expected_load(plan, static_cast<int>(i)));
  }
  int best = -1;
  double most = 0;
  for (std::size_t i = 0; i < plan.steps.size(); ++i) {
    const double gain = coverage.gain(expected_load(plan, static_cast<int>(i)));
    if (gain > most) {
      most = gain;
      best = static_cast<int>(i);
    }
  }
  ASSERT_GE(best, 0);
  EXPECT_GT(std::abs(expected_load(plan, best).wrench[5]), 5e-3);  // N m
}

}  // namespace
}  // namespace tagwrench::test
