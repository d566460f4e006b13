#include "host/core/algebra/levenberg_marquardt.h"

#include <gtest/gtest.h>

#include <functional>
#include <limits>
#include <random>

#include "tests/support/differences.h"

namespace tagwrench {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

/// A decay a exp(-b t) + c, seen at some times.
class Decay {
 public:
  explicit Decay(const Vector3d& truth, double noise = 0) {
    std::mt19937 random(1);
    std::normal_distribution<double> gauss;
    for (Eigen::Index i = 0; i < seen_.size(); ++i) seen_[i] = at(i, truth) + noise * gauss(random);
  }
  FitSums<3> operator()(const Vector3d& x) const {
    ++looks;
    FitSums<3> sums;
    for (Eigen::Index i = 0; i < seen_.size(); ++i)
      sums.add(slope(i, x), seen_[i] - at(i, x), kWeight);
    return sums;
  }
  Eigen::VectorXd residuals(const Vector3d& x) const {
    Eigen::VectorXd out = seen_;
    for (Eigen::Index i = 0; i < seen_.size(); ++i) out[i] -= at(i, x);
    return out;
  }

  static constexpr double kWeight = 4;
  mutable int looks = 0;

 private:
  static double time(Eigen::Index i) { return 0.1 * static_cast<double>(i); }
  static double at(Eigen::Index i, const Vector3d& x) {
    return x[0] * std::exp(-x[1] * time(i)) + x[2];
  }
  static Vector3d slope(Eigen::Index i, const Vector3d& x) {
    const double left = std::exp(-x[1] * time(i));
    return {left, -x[0] * time(i) * left, 1};
  }

  Eigen::VectorXd seen_ = Eigen::VectorXd::Zero(40);
};

TEST(FitSums, AreThoseOfTheResidualsAndTheirDifferences) {
  const Decay decay({3, 1.5, -1});
  const Vector3d x(2, 1, 0.5);
  const Eigen::MatrixXd slopes =
      -test::differences<3>([&](const Vector3d& step) { return decay.residuals(x + step); }, 1e-5);
  const Eigen::VectorXd residuals = decay.residuals(x);
  const FitSums<3> sums = decay(x);
  EXPECT_TRUE(sums.normal.isApprox(Decay::kWeight * slopes.transpose() * slopes, 1e-8));
  EXPECT_TRUE(sums.right.isApprox(Decay::kWeight * slopes.transpose() * residuals, 1e-8));
  EXPECT_DOUBLE_EQ(sums.squares, Decay::kWeight * residuals.squaredNorm());
}

TEST(FitSums, AStepSolvesALinearProblemAtOnce) {
  FitSums<2> line;
  for (const double t : {0.0, 1.0, 3.0}) line.add({t, 1}, 2 * t - 5);
  EXPECT_TRUE(line.step(0).isApprox(Vector2d(2, -5), 1e-12));
  EXPECT_LT(line.step(10).norm(), line.step(0).norm()) << "damped";
  EXPECT_TRUE(line.step(0, 1).isApprox(Vector2d(0, (-5 - 3 + 1) / 3.0), 1e-12)) << "the last alone";
}

TEST(FitSums, AnUnknownThatNoDatumTellsOfStays) {
  FitSums<3> sums;
  for (const double t : {0.0, 1.0, 3.0}) sums.add({t, 0, 1}, 2 * t - 5);
  EXPECT_TRUE(sums.step(0).isApprox(Vector3d(2, 0, -5), 1e-12));
}

TEST(LevenbergMarquardt, FindsTheLeastSquaresFromWhereUndampedStepsLeadAway) {
  const Vector3d truth(3, 1.5, -1);
  const Decay decay(truth);
  Vector3d undamped(1, 8, 0);
  const double before = decay(undamped).squares;
  undamped += decay(undamped).step(0);
  ASSERT_GT(decay(undamped).squares, before);
  Vector3d x(1, 8, 0);
  const FitSums<3> sums = levenberg_marquardt(x, decay, std::plus<Vector3d>());
  EXPECT_LT((x - truth).norm(), 1e-6);
  EXPECT_LT(sums.squares, 1e-10);
}

TEST(LevenbergMarquardt, EndsOnceAStepPromisesNothingAndReturnsTheSumsThere) {
  const Decay decay({3, 1.5, -1}, 0.1);
  Vector3d x(2.5, 1.2, -0.5);
  const FitSums<3> end = levenberg_marquardt(x, decay, std::plus<Vector3d>());
  EXPECT_LT(decay.looks, 10);
  EXPECT_EQ(end.squares, decay(x).squares);
  const double left = end.step(0).dot(end.right);
  EXPECT_LT(left, 1e-6 * end.squares) << "the gradient is not gone";
}

TEST(LevenbergMarquardt, KeepsToWhereThereIsAModel) {
  const Decay decay({3, 1.5, -1});
  const auto look = [&](const Vector3d& x) {
    FitSums<3> sums = decay(x);
    if (x[1] < 1.8) sums.squares = std::numeric_limits<double>::infinity();
    return sums;
  };
  Vector3d x(2, 3, 0);
  EXPECT_LT(levenberg_marquardt(x, look, std::plus<Vector3d>()).squares, look({2, 3, 0}).squares);
  EXPECT_GE(x[1], 1.8);
  Vector3d outside(2, 1, 0);
  levenberg_marquardt(outside, look, std::plus<Vector3d>());
  EXPECT_EQ(outside, Vector3d(2, 1, 0));
}

}  // namespace
}  // namespace tagwrench
