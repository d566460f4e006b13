// Models with more than six features: found where they are true, left alone where they are not.
#include <gtest/gtest.h>

#include <cmath>

#include "host/wrench/estimate.h"
#include "tests/support/differences.h"
#include "tests/unit/wrench/known_loads.h"

namespace tagwrench {
namespace {

using test::KnownLoads;

/// A hand moves a platform every way for `seconds`; what it does beyond K d is up to the test.
struct Movement {
  std::vector<Observation> observations;
  std::vector<PathPoint> path;
};

Movement move(KnownLoads& bench, double seconds, const FeatureSpec& features,
              const std::function<Vector6(const FeatureVector&)>& force) {
  constexpr double kPeriod = 0.1;
  Movement out;
  Features memory(features);
  const Matrix6 compliance = bench.stiffness.inverse();
  const auto frames = static_cast<int>(seconds / kPeriod);
  for (int i = 0; i < frames; ++i) {
    const double t = kPeriod * i;
    Vector6 wanted;
    for (int k = 0; k < 6; ++k) {
      wanted[k] = bench.full[k] * (0.6 * std::sin((0.31 + 0.07 * k) * t + k) +
                                   0.4 * std::sin((0.9 + 0.23 * k) * t + 2 * k));
    }
    const Vector6 d = compliance * wanted;
    memory.update(d, i == 0 ? 0 : kPeriod);
    Observation o;
    o.time = t;
    o.step = i / 50;
    o.displacement = d + bench.noise();
    o.displacement_covariance = bench.pose_covariance;
    o.wrench = force(memory.values()) + 1e-3 * bench.full.cwiseProduct(bench.unit());
    o.wrench_covariance = (1e-3 * bench.full).cwiseAbs2().asDiagonal();
    out.observations.push_back(o);
    out.path.push_back({t, o.displacement});
  }
  return out;
}

WrenchFit fit(const Movement& movement) {
  return fit_wrench(movement.observations, movement.path, {.prior = test::nominal_stiffness()});
}

const ModelTrial* adopted(const WrenchFit& found) {
  for (const ModelTrial& trial : found.trials) {
    if (trial.adopted) return &trial;
  }
  return nullptr;
}

TEST(RicherModels, AreNotAdoptedForALinearSpring) {
  for (unsigned seed = 0; seed < 3; ++seed) {
    KnownLoads bench(seed);
    const WrenchFit found = fit(move(bench, 60, {}, [&](const FeatureVector& phi) {
      return Vector6(bench.stiffness * phi.head<6>());
    }));
    EXPECT_GT(found.trials.size(), 8u) << "they were tried";
    EXPECT_EQ(adopted(found), nullptr) << seed;
    EXPECT_EQ(found.model.extra.cols(), 0);
  }
}

TEST(RicherModels, CreepIsFoundWithItsTimeConstant) {
  KnownLoads bench(20);
  const FeatureSpec truth{.kind = FeatureKind::creep, .time_constant = 8};
  const WrenchFit found = fit(move(bench, 120, truth, [&](const FeatureVector& phi) {
    return Vector6(bench.stiffness * (phi.head<6>() - 0.04 * phi.tail<6>()));
  }));
  const ModelTrial* winner = adopted(found);
  ASSERT_NE(winner, nullptr);
  EXPECT_EQ(winner->features.kind, FeatureKind::creep);
  EXPECT_NEAR(std::log2(winner->features.time_constant), 3, 1.01);  // a grid of powers of two
  EXPECT_LT(winner->score, 0.5);
  // A load held for long reads what it is, not 4 % more.
  EXPECT_NEAR((found.model.extra.leftCols<6>() * bench.stiffness.inverse()).trace() / 6, -0.04,
              0.01);
}

TEST(RicherModels, HysteresisIsFound) {
  KnownLoads bench(21);
  const Vector6 reach =
      (bench.stiffness.inverse() * bench.full.asDiagonal()).cwiseAbs().rowwise().sum();
  const FeatureSpec truth{.kind = FeatureKind::hysteresis, .play = 0.05 * reach};
  const WrenchFit found = fit(move(bench, 120, truth, [&](const FeatureVector& phi) {
    return Vector6(bench.stiffness * (0.8 * phi.head<6>() + 0.2 * phi.tail<6>()));
  }));
  const ModelTrial* winner = adopted(found);
  ASSERT_NE(winner, nullptr);
  EXPECT_EQ(winner->features.kind, FeatureKind::hysteresis);
  EXPECT_LT(winner->score, 0.5);
}

TEST(RicherModels, CurvatureIsFound) {
  KnownLoads bench(22);
  const WrenchFit found = fit(move(bench, 120, {}, [&](const FeatureVector& phi) {
    Vector6 w = bench.stiffness * phi.head<6>();
    w[2] += 0.05 * w[2] * w[2] / bench.full[2];  // stiffer pressed than pulled
    return w;
  }));
  const ModelTrial* winner = adopted(found);
  ASSERT_NE(winner, nullptr);
  EXPECT_EQ(winner->features.kind, FeatureKind::quadratic);
  EXPECT_EQ(found.model.extra.cols(), 21);
}

TEST(RicherModels, WithoutThePathOnlyThoseWithoutMemoryAreTried) {
  KnownLoads bench(23);
  const WrenchFit found =
      fit_wrench(bench.six_orientations(), {}, {.prior = test::nominal_stiffness()});
  ASSERT_EQ(found.trials.size(), 1u);
  EXPECT_EQ(found.trials[0].features.kind, FeatureKind::quadratic);
  EXPECT_FALSE(found.trials[0].adopted);
}

TEST(RicherModels, CurvatureIsNotLookedForWhereALoadIsMissing) {
  KnownLoads bench(24);
  std::vector<Observation> untwisted = bench.six_orientations();
  std::erase_if(untwisted,
                [](const Observation& o) { return std::abs(o.wrench[5]) > 1e-2 * 0.009; });
  ASSERT_GT(untwisted.size(), 5u);
  const WrenchFit found = fit_wrench(untwisted, {}, {.prior = test::nominal_stiffness()});
  EXPECT_FALSE(found.missing.empty());
  EXPECT_TRUE(found.trials.empty());
}

TEST(Features, CreepFollowsWithItsTimeConstant) {
  Features creep({.kind = FeatureKind::creep, .time_constant = 10});
  const Vector6 d = Vector6::Constant(1e-3);
  creep.update(Vector6::Zero(), 0);
  for (int i = 0; i < 100; ++i) creep.update(d, 0.1);
  EXPECT_NEAR(creep.values()[6], 1e-3 * (1 - std::exp(-1.0)), 1e-12);  // m, after one time constant
  EXPECT_EQ(creep.values().head(6), d);
}

TEST(Features, PlayHoldsUntilItsWidthIsUsedUp) {
  Features play({.kind = FeatureKind::hysteresis, .play = Vector6::Constant(2e-4)});
  play.update(Vector6::Constant(1e-3), 0);
  EXPECT_NEAR(play.values()[6], 8e-4, 1e-15);
  play.update(Vector6::Constant(7e-4), 0.04);
  EXPECT_NEAR(play.values()[6], 8e-4, 1e-15) << "within the play";
  EXPECT_EQ(play.jacobian()(6, 0), 0);
  play.update(Vector6::Constant(5e-4), 0.04);
  EXPECT_NEAR(play.values()[6], 7e-4, 1e-15);
  EXPECT_EQ(play.jacobian()(6, 0), 1);
}

TEST(Features, QuadraticHasTheDerivativesOfItsProducts) {
  Features quadratic({.kind = FeatureKind::quadratic});
  const Vector6 d = (Vector6() << 1, -2, 3, 0.5, -0.25, 4).finished();
  quadratic.update(d, 0);
  const FeatureVector at = quadratic.values();
  const FeatureJacobian slope = quadratic.jacobian();
  const auto moved = [&](const Vector6& step) {
    quadratic.update(d + step, 0);
    return quadratic.values();
  };
  const Eigen::MatrixXd slopes = test::differences<6>(moved, 1e-6);
  for (int j = 0; j < 6; ++j) EXPECT_TRUE(slopes.col(j).isApprox(slope.col(j), 1e-6)) << j;
  EXPECT_EQ(at[6], d[0] * d[0]);
  EXPECT_EQ(at[26], d[5] * d[5]);
}

}  // namespace
}  // namespace tagwrench
