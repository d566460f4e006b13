#include "host/wrench/shaping.h"

#include <gtest/gtest.h>

namespace tagwrench {
namespace {

Sample pushed(int axis, double value) {
  Sample s;
  s.status = Status::ok;
  s.wrench[axis] = value;
  return s;
}

ShapingOptions shaping_options() {
  ShapingOptions o;
  o.full_scale << 1, 1, 2, 0.01, 0.01, 0.01;
  o.dead_zone << 0.1, 0.1, 0.2, 0.001, 0.001, 0.001;
  return o;
}

TEST(Shaping, RestIsExactlyZeroInsideTheDeadZone) {
  Sample s = pushed(0, 0.0999);
  Shaping(shaping_options()).shape(s);
  EXPECT_EQ(s.motion, Vector6::Zero().eval());
}

TEST(Shaping, IsContinuousAtTheEdgeOfTheDeadZoneAndReachesFullScale) {
  Sample s = pushed(0, 0.1 + 1e-9);
  Shaping(shaping_options()).shape(s);
  EXPECT_NEAR(s.motion[0], 0, 1e-8);
  s = pushed(0, 1.0);
  Shaping(shaping_options()).shape(s);
  EXPECT_DOUBLE_EQ(s.motion[0], 1.0);
  s = pushed(0, -7.0);
  Shaping(shaping_options()).shape(s);
  EXPECT_DOUBLE_EQ(s.motion[0], -1.0);
}

TEST(Shaping, DefaultMountingTurnsCameraAxesIntoHidAxes) {
  // The camera looks up: its y points away from the user and its z up; HID Y is toward the user,
  // HID Z down.
  const double expected_sign[6] = {1, -1, -1, 1, -1, -1};
  for (int axis = 0; axis < 6; ++axis) {
    Sample s = pushed(axis, 5.0);
    Shaping(shaping_options()).shape(s);
    for (int i = 0; i < 6; ++i)
      EXPECT_EQ(s.motion[i], i == axis ? expected_sign[axis] : 0.0) << axis << " " << i;
  }
}

TEST(Shaping, AStatusWithoutNumbersIsNeutral) {
  for (Status status : {Status::acquiring, Status::lost, Status::doubtful}) {
    Sample s = pushed(2, 1.5);
    s.status = status;
    s.motion.setOnes();
    Shaping(shaping_options()).shape(s);
    EXPECT_EQ(s.motion, Vector6::Zero().eval());
  }
}

TEST(Shaping, SaturatedStillMoves) {
  Sample s = pushed(0, 3);
  s.status = Status::saturated;
  Shaping(shaping_options()).shape(s);
  EXPECT_EQ(s.motion[0], 1.0);
}

}  // namespace
}  // namespace tagwrench
