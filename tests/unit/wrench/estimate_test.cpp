#include "host/wrench/estimate.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <limits>

#include "tests/support/six.h"

namespace tagwrench {
namespace {

Track ok_track(const Vector6& displacement) {
  Track t;
  t.status = Status::ok;
  t.displacement = displacement;
  t.covariance = test::six(1e-12, 1e-12, 16e-12, 1e-8, 1e-8, 1e-8).asDiagonal();
  return t;
}

WrenchModel diagonal_model() {
  WrenchModel m;
  m.K = test::six(280, 280, 2800, 0.2, 0.3, 0.05).asDiagonal();
  m.B = test::six(0.01, 0, 0, 0, 0, 0);
  m.range = test::six(1, 1, 5, 0.05, 0.05, 0.05);
  return m;
}

TEST(WrenchEstimate, IsAffineInTheDisplacement) {
  Sample s;
  WrenchEstimator(diagonal_model()).estimate(ok_track(test::six(1e-3, 0, -1e-3, 0.01, 0, 0.02)), s);
  EXPECT_EQ(s.status, Status::ok);
  EXPECT_TRUE(s.wrench.isApprox(test::six(0.29, 0, -2.8, 0.002, 0, 0.001), 1e-12));
}

TEST(WrenchEstimate, SigmaIsTheDisplacementSigmaTimesStiffness) {
  Sample s;
  WrenchEstimator(diagonal_model()).estimate(ok_track(Vector6::Zero()), s);
  EXPECT_NEAR(s.wrench_sigma[2], 2800 * 4e-6, 1e-12);  // N
  EXPECT_NEAR(s.displacement_sigma[2], 4e-6, 1e-15);   // m
}

TEST(WrenchEstimate, BeyondTheRangeIsSaturatedAndStillCarriesNumbers) {
  Sample s;
  WrenchEstimator(diagonal_model()).estimate(ok_track(test::six(4e-3, 0, 0, 0, 0, 0)), s);
  EXPECT_EQ(s.status, Status::saturated);
  EXPECT_NEAR(s.wrench[0], 1.13, 1e-12);
}

TEST(WrenchEstimate, OnlyOkTracksCarryNumbers) {
  for (Status status : {Status::acquiring, Status::lost, Status::doubtful}) {
    Track t = ok_track(test::six(1e-3, 1e-3, 1e-3, 0.1, 0.1, 0.1));
    t.status = status;
    Sample s;
    WrenchEstimator(diagonal_model()).estimate(t, s);
    EXPECT_EQ(s.status, status);
    EXPECT_EQ(s.wrench, Vector6::Zero().eval());
    EXPECT_EQ(s.displacement, Vector6::Zero().eval());
  }
}

TEST(WrenchEstimate, ANumberThatIsNotFiniteIsDoubtfulAndZero) {
  Sample s;
  WrenchEstimator(diagonal_model())
      .estimate(ok_track(test::six(std::numeric_limits<double>::quiet_NaN(), 0, 0, 0, 0, 0)), s);
  EXPECT_EQ(s.status, Status::doubtful);
  EXPECT_EQ(s.wrench, Vector6::Zero().eval());
}

TEST(WrenchEstimate, MovingTheOriginToWhereAForceActsRemovesItsMoment) {
  // A force along x acting 20 mm below (camera +z) the origin has the moment z * Fx about y.
  WrenchModel m;
  m.K.setIdentity();
  m.wrench_origin = {0, 0, 0.020};
  Sample s;
  WrenchEstimator(m).estimate(ok_track(test::six(1, 0, 0, 0, 0.020, 0)), s);
  EXPECT_TRUE(s.wrench.isApprox(test::six(1, 0, 0, 0, 0, 0), 1e-12));
}

TEST(WrenchEstimate, TurningTheFrameTurnsForceAndTorqueAlike) {
  WrenchModel m;
  m.K.setIdentity();
  m.camera_R_wrench_frame =
      Eigen::AngleAxisd(M_PI / 2, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  Sample s;
  // The frame's x axis is the camera's y axis, so a push along camera y is a push along frame x.
  WrenchEstimator(m).estimate(ok_track(test::six(0, 1, 0, 0, 2, 0)), s);
  EXPECT_TRUE(s.wrench.isApprox(test::six(1, 0, 0, 2, 0, 0), 1e-12));
}

TEST(WrenchEstimate, SigmaHoldsWhatTheFitDoesNotKnowAtThisLoad) {
  WrenchModel m = diagonal_model();
  m.B.setZero();
  m.parameter_covariance = Eigen::MatrixXd::Zero(42, 42);
  m.parameter_covariance(14, 14) = 28.0 * 28.0;           // K(2, 2): 1 % of 2800 N/m
  m.parameter_covariance(38, 38) = 0.003 * 0.003;         // B[2], N
  m.error_at_full_load = test::six(0, 0, 0.02, 0, 0, 0);  // N at 2 N
  m.full_load.setConstant(2);
  m.wrench_origin = {0.010, 0, 0};
  Track track = ok_track(test::six(0, 0, 0.5e-3, 0, 0, 0));
  track.covariance.setZero();
  Sample s;
  WrenchEstimator(m).estimate(track, s);
  EXPECT_NEAR(s.wrench[2], 1.4, 1e-12);                                           // N
  const double sigma = std::sqrt(0.014 * 0.014 + 0.003 * 0.003 + 0.014 * 0.014);  // N
  EXPECT_NEAR(s.wrench_sigma[2], sigma, 1e-12);
  EXPECT_NEAR(s.wrench_sigma[4], 0.010 * sigma, 1e-12) << "its arm about the new origin, N m";
}

TEST(WrenchEstimate, CreepIsTakenOutOfALongHold) {
  // A standard linear solid: 5 % of the displacement comes late, in 10 s.
  WrenchModel m;
  m.K = 105.0 * Matrix6::Identity();
  m.features = {.kind = FeatureKind::creep, .time_constant = 10};
  m.extra = -5.0 * Matrix6::Identity();
  WrenchEstimator estimator(m);
  Sample s;
  estimator.estimate(ok_track(Vector6::Zero()), s);
  for (int i = 0; i < 10'000; ++i) {
    s.capture_time += std::chrono::milliseconds(10);
    estimator.estimate(ok_track(test::six(1e-3, 0, 0, 0, 0, 0)), s);
    if (i == 0) {
      EXPECT_NEAR(s.wrench[0], 0.105, 1e-5);  // N, at once
    }
  }
  EXPECT_NEAR(s.wrench[0], 0.100, 1e-5);  // N, after 100 s
}

}  // namespace
}  // namespace tagwrench
