// The calibration plan of a sensor to be built: its points are on the printed hood, its weight is
// one that the springs bear.
#include "host/calibration/wrench/plan.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>

#include "host/commands/design_hardware.h"
#include "host/tools/design/geometry.h"
#include "host/tools/design/parameters.h"

namespace tagwrench {
namespace {

class ShippedSensor : public testing::TestWithParam<std::string> {
 protected:
  const hardware::Parameters p_ =
      load_hardware(TAGWRENCH_SOURCE_DIR "/hardware/sensors/" + GetParam() + ".yaml");
  const hardware::Geometry g_ = hardware::geometry(p_);
};

TEST_P(ShippedSensor, IsHungFromFourPointsJustOffItsWallsBelowItsTop) {
  const auto points = hardware::load_points(p_, g_);
  const double open = p_.top.walls == 3 ? 0 : p_.printing.wall;
  const double knob = 0.5 * p_.top.knob_diameter;
  const double right = p_.top.knob ? knob : g_.inner_x_to + open;
  const double left = p_.top.knob ? knob : p_.printing.wall - g_.inner_x_from;
  const double side = p_.top.knob ? knob : g_.inner_y + p_.printing.wall;
  EXPECT_NEAR(points[0].x(), right + 0.5e-3, 1e-6);
  EXPECT_NEAR(points[1].x(), -left - 0.5e-3, 1e-6);
  EXPECT_NEAR(points[2].y(), side + 0.5e-3, 1e-6);
  EXPECT_NEAR(points[3].y(), -side - 0.5e-3, 1e-6);
  for (const Eigen::Vector3d& point : points) {
    EXPECT_EQ((point.head<2>().array() == 0).count(), 1);
    EXPECT_LT(g_.platform + point.z(), g_.top);
  }
}

TEST_P(ShippedSensor, BearsThePlansWeightInEveryDirection) {
  const Vector6 range = hardware::range(p_, g_);
  const double newtons = 9.81 * hardware::load_mass(p_, g_);
  double most = 0;
  for (const Eigen::Vector3d& point : hardware::load_points(p_, g_)) {
    for (int axis = 0; axis < 3; ++axis) {
      const Eigen::Vector3d force = newtons * Eigen::Vector3d::Unit(axis);
      most = std::max(most, (force.cwiseAbs().cwiseQuotient(range.head<3>()).sum() +
                             point.cross(force).cwiseAbs().cwiseQuotient(range.tail<3>()).sum()));
    }
  }
  EXPECT_LE(most, 0.91);
  EXPECT_GE(most, 0.4) << "a heavier one would tell more";
}

TEST_P(ShippedSensor, HasAPlanWithItsOwnPointsAndWeight) {
  const std::string text = hardware_plan(p_);
  const WrenchPlan plan = parse_plan(text, GetParam() + "/plan.yaml");
  const WrenchPlan ready = parse_plan(plan_text("six_orientations"), "six_orientations");
  const auto points = hardware::load_points(p_, g_);
  ASSERT_EQ(plan.points.size(), points.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    EXPECT_EQ(plan.points[i].name, ready.points[i].name);
    EXPECT_LT((plan.points[i].position - points[i]).norm(), 1e-5);
  }
  ASSERT_EQ(plan.steps.size(), ready.steps.size());
  int loads = 0;
  for (const PlanStep& step : plan.steps) {
    if (step.kind != StepKind::mass) continue;
    EXPECT_NEAR(step.mass, hardware::load_mass(p_, g_), 1e-9);
    ++loads;
  }
  EXPECT_EQ(loads, 12);
}

INSTANTIATE_TEST_SUITE_P(Hardware, ShippedSensor,
                         testing::Values("paper", "puck", "gripper40", "single", "mirror",
                                         "endoscope"),
                         [](const auto& name) { return name.param; });

}  // namespace
}  // namespace tagwrench
