// Constant velocity, by the clock of the frames.
#include <gtest/gtest.h>

#include <chrono>

#include "host/tracker/rotation.h"
#include "tests/support/six.h"

namespace tagwrench {
namespace {

using std::chrono::milliseconds;

constexpr double kRounding = 1e-12;  // m, rad

TimePoint at(int ms) { return TimePoint{} + milliseconds(ms); }

/// A pose that is turned, so that axes cannot be mixed up.
Eigen::Isometry3d somewhere() {
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  pose.linear() = rotation_from_vector({0.4, -0.2, 0.3});
  pose.translation() = Eigen::Vector3d(1e-3, -2e-3, 0.02);
  return pose;
}

void expect_motion(const Eigen::Isometry3d& from, const Eigen::Isometry3d& to,
                   const Vector6& motion) {
  EXPECT_LT((motion_between(from, to) - motion).cwiseAbs().maxCoeff(), kRounding)
      << motion_between(from, to).transpose();
}

const Vector6 kStep = test::six(1e-5, -2e-5, 3e-5, 1e-3, 2e-3, -3e-3);

/// Two frames, 40 ms and kStep apart, the later one at 40 ms.
ConstantVelocityPredictor moving() {
  ConstantVelocityPredictor predictor;
  predictor.start(at(0), somewhere());
  predictor.add(at(40), moved(somewhere(), kStep));
  return predictor;
}

TEST(ConstantVelocityPredictor, IsPredictedByTheTimeThatHasPassed) {
  const ConstantVelocityPredictor predictor = moving();
  expect_motion(predictor.last(), predictor.predict(at(80)), kStep);
  expect_motion(predictor.last(), predictor.predict(at(60)), 0.5 * kStep);
  expect_motion(predictor.last(), predictor.predict(at(120)), 2 * kStep);  // a frame was lost
}

TEST(ConstantVelocityPredictor, IsNotPredictedAcrossALongGapNorBackInTime) {
  const ConstantVelocityPredictor predictor = moving();
  for (const int ms : {40 + 150, 40 + 4000, 40, 20})
    expect_motion(predictor.last(), predictor.predict(at(ms)), Vector6::Zero());
}

TEST(ConstantVelocityPredictor, IsForgottenWhenItStartsAnew) {
  ConstantVelocityPredictor predictor = moving();
  predictor.start(at(80), somewhere());
  expect_motion(somewhere(), predictor.predict(at(120)), Vector6::Zero());
  EXPECT_TRUE(predictor.velocity(at(120), moved(somewhere(), kStep)).isZero(0));
}

TEST(ConstantVelocityPredictor, VelocityOfASteadilyGrowingSpeedIsTheOneAtTheEnd) {
  // Half of a t^2, also when the frames do not come evenly.
  const Vector6 acceleration = kStep / 1e-3;
  const auto pose = [&](double t) { return moved(somewhere(), 0.5 * t * t * acceleration); };
  ConstantVelocityPredictor predictor;
  predictor.start(at(0), pose(0));
  predictor.add(at(40), pose(0.040));
  const Vector6 velocity = predictor.velocity(at(80), pose(0.080));
  EXPECT_LT((velocity - 0.080 * acceleration).cwiseAbs().maxCoeff(), 1e-9) << velocity.transpose();
}

}  // namespace
}  // namespace tagwrench
