#include "host/wrench/fit.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "host/core/config_error.h"
#include "tests/unit/wrench/known_loads.h"

namespace tagwrench {
namespace {

using test::Errors;
using test::KnownLoads;

WrenchFit fit(const std::vector<Observation>& observations) {
  return fit_wrench(observations, {}, {.prior = test::nominal_stiffness(), .try_richer = false});
}

std::string refusal(const std::vector<Observation>& observations, const FitOptions& options) {
  try {
    fit_wrench(observations, {}, options);
  } catch (const ConfigError& e) {
    return e.what();
  }
  return "(accepted)";
}

/// 24 loads; those along one axis left out.
std::vector<Vector6> loads_without(KnownLoads& bench, int axis) {
  std::vector<Vector6> out;
  for (int i = 0; i < 24; ++i) {
    Vector6 w = bench.random_load();
    if (axis >= 0) w[axis] = 0;
    out.push_back(w);
  }
  return out;
}

TEST(WrenchFit, FindsTheStiffnessBehindNoisyKnownLoads) {
  KnownLoads bench(1, {.mass = 1e-4, .gravity = 1e-3, .point = 0.02e-3});
  const WrenchFit found = fit(bench.six_orientations());
  const Matrix6 nominal = test::nominal_stiffness();
  for (int i = 0; i < 6; ++i) {
    EXPECT_EQ(found.axis[static_cast<std::size_t>(i)].state, AxisState::calibrated) << i;
    for (int j = 0; j < 6; ++j) {
      // Its springs' description is 8 % off; the fit is not.
      EXPECT_NEAR(found.model.K(i, j), bench.stiffness(i, j),
                  0.006 * std::sqrt(nominal(i, i) * nominal(j, j)))
          << i << j;
    }
  }
  EXPECT_TRUE(found.missing.empty());
  EXPECT_TRUE(found.warnings.empty());
}

TEST(WrenchFit, IntervalsOf95PercentHoldNineToNineNineOfTenNewLoads) {
  constexpr int kSeeds = 200;
  constexpr int kLoads = 20;
  Vector6 inside = Vector6::Zero(), held_out = Vector6::Zero(), squares = Vector6::Zero();
  for (unsigned seed = 0; seed < kSeeds; ++seed) {
    KnownLoads bench(seed, {.nonlinear = 0.005});
    WrenchFit found = fit(bench.six_orientations());
    found.model.B.setZero();  // the new loads count from a fresh zero
    WrenchEstimator estimator(found.model);
    for (int i = 0; i < kLoads; ++i) {
      const Vector6 load = bench.random_load();
      Track track;
      track.status = Status::ok;
      track.displacement = bench.displacement_of(load) + bench.noise();
      track.covariance = bench.pose_covariance;
      Sample sample;
      estimator.estimate(track, sample);
      const Vector6 error = sample.wrench - load;
      inside +=
          (error.cwiseAbs().array() <= 1.96 * sample.wrench_sigma.array()).cast<double>().matrix();
      squares += error.cwiseQuotient(bench.full).cwiseAbs2();
    }
    for (int i = 0; i < 6; ++i) held_out[i] += found.inside_95[static_cast<std::size_t>(i)];
  }
  for (int i = 0; i < 6; ++i) {
    EXPECT_GT(inside[i] / (kSeeds * kLoads), 0.90) << i;
    EXPECT_LT(inside[i] / (kSeeds * kLoads), 0.99) << i;
    EXPECT_GT(held_out[i] / kSeeds, 0.90) << i;
    EXPECT_LT(held_out[i] / kSeeds, 0.99) << i;
    // With 0.3 % masses, 0.6 degrees and 0.2 mm, one cannot know torques better than this.
    EXPECT_LT(std::sqrt(squares[i] / (kSeeds * kLoads)), 0.013) << i;  // of full load
  }
}

TEST(WrenchFit, NamesTheTorqueThatWasNeverApplied) {
  KnownLoads bench(3);
  const std::vector<Observation> seen = bench.applied(loads_without(bench, 5), 0);
  const WrenchFit found = fit(seen);
  EXPECT_EQ(found.missing, std::vector<std::string>{"Mz"});
  EXPECT_EQ(found.axis[5].state, AxisState::spring_model);
  EXPECT_EQ(found.axis[5].reason, "no torque about z was applied");
  EXPECT_LT(found.axis[5].coverage, 0.3);
  EXPECT_GT(found.axis[5].gain_sigma, 0.1);
  EXPECT_GT(found.model.range[5], 1e8) << "not known";
  for (std::size_t i = 0; i < 5; ++i) {
    EXPECT_EQ(found.axis[i].state, AxisState::calibrated) << i << found.axis[i].reason;
    EXPECT_NEAR(found.model.range[static_cast<int>(i)], found.axis[i].largest, 1e-12);
  }
  EXPECT_NE(refusal(seen, {.prior = test::nominal_stiffness(), .require_all = true})
                .find("Mz is not calibrated (no torque about z was applied)"),
            std::string::npos);
  const WrenchFit without_springs = fit_wrench(seen, {}, {.try_richer = false});
  EXPECT_EQ(without_springs.axis[5].state, AxisState::not_determined);
  EXPECT_EQ(without_springs.axis[0].state, AxisState::calibrated);
}

TEST(WrenchFit, NamesLoadsThatOnlyCameTogether) {
  KnownLoads bench(4);
  std::vector<Vector6> loads = loads_without(bench, -1);
  for (Vector6& w : loads) w[4] = 0.015 * w[0];  // every push along x at the same height
  const WrenchFit found = fit(bench.applied(loads, 0));
  ASSERT_EQ(found.missing.size(), 1u);
  EXPECT_EQ(found.missing[0], "Fx and My apart from each other");
  EXPECT_NE(found.axis[4].state, AxisState::calibrated);
  EXPECT_EQ(found.axis[4].reason, "Fx and My were only applied together");
}

TEST(WrenchFit, AxesThatTheDataDoNotReachKeepTheSprings) {
  KnownLoads bench(5);
  const WrenchFit found = fit(bench.applied(loads_without(bench, 5)));
  const Matrix6 nominal = test::nominal_stiffness();
  // The column that only a twist would show.
  EXPECT_NEAR(found.model.K(5, 5), nominal(5, 5), 0.15 * nominal(5, 5));
}

TEST(WrenchFit, ReciprocityTellsWhatAPushOffItsLineCannot) {
  // Upright masses are three times as heavy as those that pull across, and half a degree off.
  const auto error = [](double reciprocity) {
    double worst = 0;
    for (unsigned seed = 30; seed < 36; ++seed) {
      KnownLoads bench(seed, {.gravity = 0.01, .point = 0.02e-3});
      const WrenchFit found = fit_wrench(
          bench.six_orientations(), {},
          {.prior = test::nominal_stiffness(), .reciprocity = reciprocity, .try_richer = false});
      // What it reads along x under a load along z.
      const Vector6 load = Vector6::Unit(2);
      const Vector6 read = found.model.K * bench.stiffness.inverse() * load;
      worst = std::max(worst, std::hypot(read[0], read[1]));
    }
    return worst;
  };
  EXPECT_LT(error(0.005), 0.6 * error(0));
}

TEST(WrenchFit, AStructureThatIsNotConservativeIsNoticed) {
  KnownLoads bench(31, {.mass = 1e-4, .gravity = 1e-3, .point = 0.02e-3, .asymmetry = 0.05});
  const WrenchFit found = fit(bench.six_orientations());
  ASSERT_EQ(found.warnings.size(), 1u);
  EXPECT_TRUE(found.warnings[0].starts_with("K is not symmetric by ")) << found.warnings[0];
  const Matrix6 ratio = found.model.K * bench.stiffness.inverse();
  EXPECT_LT((ratio - Matrix6::Identity()).diagonal().cwiseAbs().maxCoeff(), 0.01);
}

TEST(WrenchFit, AWrongMassIsFoundAndLeftOut) {
  for (unsigned seed = 0; seed < 5; ++seed) {
    KnownLoads bench(seed);
    std::vector<Observation> seen = bench.six_orientations();
    const Vector6 before = fit(seen).model.K.row(0).transpose();
    Observation& wrong = seen[9 + seed];
    ASSERT_GT(wrong.wrench.norm(), 0.1);
    // What the tracker saw was 12 % more than the plan says.
    const int zero = wrong.zero;
    for (const Observation& o : seen) {
      if (o.zero == zero && o.wrench.norm() == 0) {
        wrong.displacement += 0.12 * (wrong.displacement - o.displacement);
        break;
      }
    }
    const WrenchFit found = fit(seen);
    int rejected = 0;
    for (const BlockFit& block : found.blocks) {
      if (!block.rejected) continue;
      ++rejected;
      EXPECT_EQ(block.step, wrong.step);
      EXPECT_NEAR(block.load_ratio, 1.12, 0.01);
      EXPECT_NE(block.remark.find("step " + std::to_string(wrong.step + 1) + ": shows 12 % more"),
                std::string::npos)
          << block.remark;
    }
    EXPECT_EQ(rejected, 1) << seed;
    EXPECT_EQ(found.warnings.size(), 1u);
    EXPECT_LT((found.model.K.row(0).transpose() - before).norm(), 0.01 * before.norm());
  }
}

TEST(WrenchFit, AHealthyCalibrationRejectsHardlyAnything) {
  int rejected = 0;
  int blocks = 0;
  for (unsigned seed = 100; seed < 120; ++seed) {
    KnownLoads bench(seed);
    for (const BlockFit& block : fit(bench.six_orientations()).blocks) {
      ++blocks;
      if (block.rejected) ++rejected;
    }
  }
  EXPECT_GT(blocks, 900);
  EXPECT_LE(rejected, blocks / 200);
}

TEST(WrenchFit, TheErrorOfOneMassDoesNotAverageAway) {
  // One mass, known to 1 %, hung forty times.
  KnownLoads bench(6, {.mass = 0.01, .gravity = 1e-4, .point = 1e-6, .hang = 1e-4});
  std::vector<Eigen::Vector3d> points;
  for (int i = 0; i < 5; ++i) points.push_back({4e-3 * (i - 2), 5e-3 * (i % 3 - 1), -5e-3});
  const std::vector<Eigen::Vector3d> ways{{1, 0, 0},  {-1, 0, 0}, {0, 1, 0}, {0, -1, 0},
                                          {0, 0, -1}, {0, 0, 1},  {1, 1, 0}, {1, 0, 1}};
  const WrenchFit found = fit(bench.hung(ways, points, {0.1}));
  EXPECT_NEAR(found.axis[0].gain_sigma, 0.01, 0.001);
  EXPECT_NEAR(found.axis[2].gain_sigma, 0.01, 0.001);
  bool named = false;
  for (const CorrelatedEstimate& common : found.common) {
    if (common.name != "mass 0") continue;
    named = true;
    EXPECT_GT(common.sigma, 0.95) << "forty hangs say nothing about the mass itself";
  }
  EXPECT_TRUE(named);
}

TEST(WrenchFit, AMassThatIsNotWhatItSaysIsNamed) {
  KnownLoads bench(8, {.mass = 1e-3, .gravity = 1e-3, .point = 0.02e-3, .hang = 1e-4});
  std::vector<Observation> seen =
      bench.hung({{1, 0, 0}, {0, 1, 0}, {0, 0, -1}, {0, 0, 1}, {-1, 0, 0}, {0, -1, 0}},
                 {{15e-3, 10e-3, -5e-3}, {-15e-3, 10e-3, -5e-3}}, {0.05, 0.07, 0.1, 0.12});
  for (Observation& o : seen) {
    if (o.common.empty() || o.common[0].name != "mass 2") continue;
    o.wrench *= 1.008;  // eight times what is stated
    for (CorrelatedError& error : o.common) error.effect *= 1.008;
  }
  const WrenchFit found = fit(seen);
  bool named = false;
  for (const std::string& warning : found.warnings)
    named = named || warning.starts_with("mass 2: off by ");
  EXPECT_TRUE(named);
}

TEST(WrenchFit, FramesOfOnePushDoNotCountAsIndependent) {
  // A movement by hand, 2000 frames, against a reference whose error drifts slowly within a second.
  KnownLoads bench(9);
  std::vector<Observation> seen;
  Vector6 drift = Vector6::Zero();
  const double sigma = 0.01;  // of full load
  for (int i = 0; i < 2000; ++i) {
    const double t = 0.04 * i;
    Vector6 w;
    for (int k = 0; k < 6; ++k) w[k] = bench.full[k] * std::sin((0.9 + 0.37 * k) * t + k);
    drift = 0.96 * drift + std::sqrt(1 - 0.96 * 0.96) * sigma * bench.unit();
    Observation o;
    o.time = t;
    o.step = i / 400;
    o.displacement = bench.displacement_of(w) + bench.noise();
    o.displacement_covariance = bench.pose_covariance;
    o.wrench = w + drift.cwiseProduct(bench.full);
    o.wrench_covariance = (sigma * bench.full).cwiseAbs2().asDiagonal();
    seen.push_back(o);
  }
  const WrenchFit found = fit(seen);
  // 2000 frames, but about 80 / (2 * 25 * 0.04 s) = 40 independent ones: 1 % / sqrt(40 / 2).
  EXPECT_GT(found.axis[0].gain_sigma, 0.0012);
  EXPECT_LT(found.axis[0].gain_sigma, 0.006);
  for (const AxisFit& axis : found.axis) EXPECT_EQ(axis.state, AxisState::calibrated);
}

TEST(WrenchFit, NoiseInTheDisplacementDoesNotFlattenTheStiffness) {
  // Noise of a tenth of the movement: ordinary least squares would lose 1 % of stiffness.
  KnownLoads bench(10);
  std::vector<Vector6> loads;
  for (int i = 0; i < 4000; ++i) loads.push_back(0.7 * bench.full.cwiseProduct(bench.unit()));
  const Matrix6 compliance = bench.stiffness.inverse();
  const Matrix6 moved =
      compliance * (0.7 * bench.full).cwiseAbs2().asDiagonal() * compliance.transpose();
  bench.pose_covariance = (0.1 * 0.1 * moved.diagonal()).asDiagonal();
  const WrenchFit found = fit(bench.applied(loads, 1e-3));
  const Matrix6 ratio = found.model.K * bench.stiffness.inverse();
  // About sqrt(0.01 / 4000) a unit of noise; 1 % would be seen.
  EXPECT_NEAR(ratio.trace() / 6, 1.0, 0.003);
}

TEST(WrenchFit, RefusesWhatCannotBeFitted) {
  KnownLoads bench(11);
  const std::vector<Observation> good = bench.applied(loads_without(bench, -1));
  const FitOptions springs{.prior = test::nominal_stiffness()};
  EXPECT_NE(refusal({}, springs).find("no step has been taken"), std::string::npos);
  EXPECT_NE(refusal({good[0], good.back()}, springs).find("no observation carries a load"),
            std::string::npos);
  EXPECT_NE(refusal({good.begin(), good.begin() + 5}, {}).find("5 observations for 7 unknowns"),
            std::string::npos);
  std::vector<Observation> bad = good;
  bad[3].displacement[2] = std::numeric_limits<double>::quiet_NaN();
  EXPECT_NE(refusal(bad, springs).find("observation 4 (step 4, 30.000 s) has a number that is not"),
            std::string::npos);
  bad = good;
  bad[3].wrench_covariance(0, 0) = -1;
  EXPECT_NE(refusal(bad, springs).find("wrench_covariance that is no covariance"),
            std::string::npos);
  bad = good;
  bad[3].displacement_covariance(0, 1) = bad[3].displacement_covariance(1, 0) = 1;
  EXPECT_NE(refusal(bad, springs).find("displacement_covariance that is no covariance"),
            std::string::npos);
  EXPECT_NE(refusal(good, {.zero_in_use = 7}).find("mounting 8"), std::string::npos);
}

TEST(WrenchFit, AConstantDisplacementIsNotDetermined) {
  KnownLoads bench(12);
  std::vector<Observation> seen = bench.applied(loads_without(bench, -1));
  for (Observation& o : seen) o.displacement.setZero();
  const WrenchFit found = fit_wrench(seen, {}, {.try_richer = false});
  for (const AxisFit& axis : found.axis) EXPECT_EQ(axis.state, AxisState::not_determined);
}

TEST(WrenchFit, CoverageGrowsWithTheStepsTaken) {
  KnownLoads bench(13);
  const std::vector<Observation> seen = bench.six_orientations();
  const Matrix6 springs = test::nominal_stiffness();
  Vector6 last = Vector6::Zero();
  for (const std::size_t count : {std::size_t{1}, std::size_t{8}, std::size_t{24}, seen.size()}) {
    const Vector6 now = coverage({seen.data(), count}, springs, 0.3);
    EXPECT_TRUE((now.array() >= last.array() - 0.02).all()) << count;
    last = now;
  }
  EXPECT_GT(last.minCoeff(), 0.85);
}

}  // namespace
}  // namespace tagwrench
