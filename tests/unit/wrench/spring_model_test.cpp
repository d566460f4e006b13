#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>

#include "host/wrench/estimate.h"
#include "tests/support/six.h"

namespace tagwrench {
namespace {

// Four springs at the corners of a 22 x 16 mm rectangle, elastic centres 10 mm towards the camera.
Springs four_springs() {
  Springs s;
  for (double x : {-0.011, 0.011}) {
    for (double y : {-0.008, 0.008}) s.centres.push_back({x, y, -0.010});
  }
  s.axial = 700;
  s.lateral = 70;
  s.bending = 0.003;
  s.torsion = 0.002;
  return s;
}

TEST(SpringModel, AxialPushIsFourSpringsInParallel) {
  const Vector6 w = stiffness(four_springs()) * test::six(0, 0, 1e-3, 0, 0, 0);
  EXPECT_NEAR(w[2], 2.8, 1e-12);  // N: 4 * 700 N/m * 1 mm
  EXPECT_NEAR(w.cwiseAbs().sum(), 2.8, 1e-12);
}

TEST(SpringModel, LateralPushNeedsATorqueBecauseTheSpringsHoldBelowTheOrigin) {
  const Vector6 w = stiffness(four_springs()) * test::six(1e-3, 0, 0, 0, 0, 0);
  EXPECT_NEAR(w[0], 0.28, 1e-12);           // N
  EXPECT_NEAR(w[4], -0.010 * 0.28, 1e-12);  // N m about y: z * Fx with z = -10 mm
}

TEST(SpringModel, YawWorksLateralSpringsAtTheirRadiusPlusTorsion) {
  const double yaw_rad = 0.01;
  const Vector6 w = stiffness(four_springs()) * test::six(0, 0, 0, 0, 0, yaw_rad);
  const double radius_squared = 0.011 * 0.011 + 0.008 * 0.008;
  EXPECT_NEAR(w[5], 4 * (70 * radius_squared + 0.002) * yaw_rad, 1e-12);
}

TEST(SpringModel, TiltWorksAxialSpringsAtTheirArm) {
  const double tilt_rad = 0.01;
  const Vector6 w = stiffness(four_springs()) * test::six(0, 0, 0, tilt_rad, 0, 0);
  EXPECT_NEAR(w[3], 4 * (700 * 0.008 * 0.008 + 70 * 0.010 * 0.010 + 0.003) * tilt_rad, 1e-12);
}

TEST(SpringModel, IsSymmetricAndStableBecauseItComesFromAnEnergy) {
  const Matrix6 K = stiffness(four_springs());
  EXPECT_LT((K - K.transpose()).cwiseAbs().maxCoeff(), 1e-12);
  EXPECT_GT(Eigen::SelfAdjointEigenSolver<Matrix6>(K).eigenvalues().minCoeff(), 0);
}

}  // namespace
}  // namespace tagwrench
