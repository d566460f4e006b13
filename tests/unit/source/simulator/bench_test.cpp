// The simulated person at the bench: statics of what hangs, strokes of a push, errors of their
// stated size, orders one after the other.
#include "host/source/simulator/bench.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <Eigen/Geometry>
#include <cmath>
#include <numbers>
#include <vector>

#include "tests/unit/source/simulator/bench_rig.h"

namespace tagwrench::sim {
namespace {

const Eigen::Vector3d kBolt{15e-3, 4e-3, 6e-3};

/// A force that takes hold of a point of the displaced platform, about the origin at rest.
Vector6 at_point(const Eigen::Vector3d& force, const Eigen::Vector3d& point, const Vector6& d) {
  const Eigen::Vector3d r = d.tail<3>();
  const Eigen::Vector3d now =
      d.head<3>() + Eigen::AngleAxisd(r.norm(), r.norm() > 0
                                                    ? Eigen::Vector3d(r.normalized())
                                                    : Eigen::Vector3d(Eigen::Vector3d::UnitX())) *
                        point;
  Vector6 wrench;
  wrench << force, now.cross(force);
  return wrench;
}

TEST(Bench, ADisplacedPlatformHoldsTheHungMassAndItsOwnWeight) {
  for (const Eigen::Vector3d& gravity :
       {Eigen::Vector3d(0, 0, -1), Eigen::Vector3d(1, 0, 0), Eigen::Vector3d(0, -1, 0),
        Eigen::Vector3d(0, 0, 1), Eigen::Vector3d(0.6, 0, -0.8)}) {
    BenchRig rig(perfect());
    const double g = rig.bench.settings().gravity;
    rig.bench.turn(gravity);
    rig.finish();
    rig.run(2);
    Vector6 own;
    const Eigen::Vector3d change = rig.mechanics.mass * g * (gravity + Eigen::Vector3d::UnitZ());
    own << change, rig.mechanics.centre_of_mass.cross(change);
    const Matrix6 k = rig.motion.stiffness_matrix();
    const double least = 1e-6 * rig.mechanics.mass * g;
    EXPECT_LT((k * rig.displacement() - own).norm(), 1e-4 * own.norm() + least) << gravity;
    EXPECT_EQ(rig.wrench(), Vector6::Zero()) << "nobody applies the platform's own weight";

    rig.bench.hang(0.05, kBolt);
    rig.finish();
    rig.run(3);
    const Vector6 d = rig.displacement();
    const Vector6 load = at_point(0.05 * g * gravity, kBolt, d);
    EXPECT_LT((k * d - own - load).norm(), 1e-5 * load.norm()) << gravity;
    EXPECT_LT((rig.wrench() - load).norm(), 1e-9);
  }
}

TEST(Bench, APointThatMovesWithThePlatformIsWorthPercentsOfTheTorque) {
  BenchRig rig(perfect());
  rig.bench.hang(0.05, kBolt);
  rig.finish();
  rig.run(3);
  const Eigen::Vector3d force = rig.wrench().head<3>();
  const Eigen::Vector3d as_if_at_rest = kBolt.cross(force);
  const double off = (rig.wrench().tail<3>() - as_if_at_rest).norm() / as_if_at_rest.norm();
  EXPECT_GT(off, 0.01);
  EXPECT_LT(off, 0.1);
}

TEST(Bench, AMassSwingsAsAPendulumUntilThatHasDecayed) {
  BenchSettings settings = perfect();
  settings.perfect = false;
  settings.errors = {0, 0, 0, 0, 0, 0, 0, 0, 0};
  BenchRig rig(settings);
  rig.bench.hang(0.05, Eigen::Vector3d::Zero());
  rig.finish();
  const double weight = 0.05 * settings.gravity;
  const double let_go = rig.time;
  std::vector<double> zero_times;
  double before = 0, first_second = 0, fourth_second = 0;
  double lightest = 2, heaviest = 0;
  rig.watch(5, [&] {
    // The two sideways parts, of which the larger swings along the axis that unitOrthogonal chose.
    const Eigen::Vector2d sideways = rig.wrench().head<2>() / weight;
    const double angle = std::abs(sideways.x()) > 1e-12 ? sideways.x() : sideways.y();
    if (before * angle < 0 && rig.time < let_go + 2) zero_times.push_back(rig.time);
    before = angle;
    const double since = rig.time - let_go;
    if (since < 1) first_second = std::max(first_second, sideways.norm());
    lightest = std::min(lightest, rig.wrench().head<3>().norm() / weight);
    heaviest = std::max(heaviest, rig.wrench().head<3>().norm() / weight);
    if (since >= 3 && since < 4) fourth_second = std::max(fourth_second, sideways.norm());
  });
  EXPECT_NEAR(first_second, settings.times.swing_rad, 2e-3) << "rad";
  EXPECT_NEAR(fourth_second / settings.times.swing_rad, std::exp(-3 / settings.times.swing_decay),
              0.008);
  // The string bears m g cos a where the mass stands, more where it goes round, and m g (1 + a^2)
  // in the middle were it never to lose anything on its way there.
  const double swing = settings.times.swing_rad;
  EXPECT_GT(lightest, std::cos(swing));
  EXPECT_LT(lightest, 1 - 0.2 * swing * swing);
  EXPECT_GT(heaviest, 1 + 0.3 * swing * swing);
  EXPECT_LT(heaviest, 1 + swing * swing);
  ASSERT_GE(zero_times.size(), 4U);
  const double period =
      2 * std::numbers::pi * std::sqrt(settings.times.string_length / settings.gravity);  // s
  EXPECT_NEAR(zero_times.at(3) - zero_times.at(1), period, 2e-3);
  EXPECT_LT((rig.wrench().head<3>() - weight * -Eigen::Vector3d::UnitZ()).norm(), 1e-3 * weight);
}

TEST(Bench, APushNeverPullsAndStrokesUpToAboutItsPeak) {
  BenchRig rig({});
  constexpr double kPeak = 0.8;
  const Eigen::Vector3d along = Eigen::Vector3d(1, 0, 0.5).normalized();
  rig.bench.push(kBolt, along, kPeak, 6, 3);
  int strokes = 0;
  bool pressed = false;
  double most = 0, widest = 0;
  while (rig.bench.busy()) {
    rig.run(2e-3);
    const double cell = rig.bench.cell_force(rig.time);
    const Vector6 wrench = rig.wrench();
    EXPECT_GE(cell, 0);
    EXPECT_NEAR(wrench.head<3>().norm(), cell, 1e-9);
    if (cell > 0) widest = std::max(widest, std::acos(wrench.head<3>().dot(along) / cell));
    most = std::max(most, cell);
    if (!pressed && cell > 0.5 * kPeak) ++strokes;
    pressed = cell > (pressed ? 0.2 : 0.5) * kPeak;
    const Vector6 expected =
        at_point(wrench.head<3>(), kBolt, rig.displacement());  // but for where exactly it sits
    EXPECT_LT((wrench - expected).norm(), 1.1e-3 * (cell + 1e-9)) << "N m of " << cell << " N";
  }
  EXPECT_EQ(strokes, 3);
  EXPECT_GT(most, 0.7 * kPeak);
  EXPECT_LE(most, kPeak);
  EXPECT_GT(widest, 1e-3) << "rad; a hand is never quite straight";
  EXPECT_LT(widest, 0.06);
  rig.run(0.1);
  EXPECT_EQ(rig.bench.cell_force(rig.time), 0);
  EXPECT_EQ(rig.wrench(), Vector6::Zero());
}

TEST(Bench, MovingAboutReachesEveryAxisBothWaysWithinItsAmplitude) {
  BenchRig rig({});
  const Vector6 amplitude = (Vector6() << 0.5, 0.4, 1.2, 6e-3, 7e-3, 4e-3).finished();
  rig.bench.move_about(amplitude, 20);
  Vector6 low = Vector6::Zero(), high = Vector6::Zero();
  while (rig.bench.busy()) {
    rig.run(0.01);
    low = low.cwiseMin(rig.wrench());
    high = high.cwiseMax(rig.wrench());
  }
  for (int axis = 0; axis < 6; ++axis) {
    EXPECT_LT(low[axis], -0.5 * amplitude[axis]) << axis;
    EXPECT_GT(high[axis], 0.5 * amplitude[axis]) << axis;
    EXPECT_GE(low[axis], -1.03 * amplitude[axis]) << axis;
    EXPECT_LE(high[axis], 1.03 * amplitude[axis]) << axis;
  }
  EXPECT_EQ(rig.wrench(), Vector6::Zero());
}

TEST(Bench, ErrorsAreAsLargeAsStatedAndThoseOfThingsStayWithThem) {
  constexpr int kSeeds = 600;
  constexpr double kTolerance = 0.12;  // of a standard deviation from 600 numbers: four of its own
  double mass = 0, point = 0, gravity = 0, direction = 0;
  const BenchSettings settings;
  for (std::uint64_t seed = 1; seed <= kSeeds; ++seed) {
    Bench bench(settings, seed);
    const double off = bench.true_mass(0.05) / 0.05 - 1;
    EXPECT_EQ(bench.true_mass(0.05) / 0.05 - 1, off);
    mass += off * off / kSeeds;
    const Eigen::Vector3d where = bench.true_point(kBolt) - kBolt;
    EXPECT_EQ(bench.true_point(kBolt) - kBolt, where);
    point += where.squaredNorm() / 3 / kSeeds;
    const Eigen::Vector3d down = bench.true_gravity();
    gravity += down.head<2>().squaredNorm() / 2 / kSeeds;
    // One push, long enough that the sway is seen about its middle.
    bench.push(Eigen::Vector3d::Zero(), Eigen::Vector3d::UnitX(), 1, 1, 1);
    const Vector6 wrench = bench.wrench(bench.settings().times.reaction + 0.5, Vector6::Zero());
    direction += (wrench.segment<2>(1) / wrench[0]).squaredNorm() / 2 / kSeeds;
  }
  const BenchErrors& e = settings.errors;
  EXPECT_NEAR(std::sqrt(mass) / e.mass, 1, kTolerance);
  EXPECT_NEAR(std::sqrt(point) / e.point, 1, kTolerance);
  EXPECT_NEAR(std::sqrt(gravity) / e.gravity_rad, 1, kTolerance);
  EXPECT_NEAR(std::sqrt(direction) / std::hypot(e.direction_rad, e.sway_rad), 1, kTolerance);
}

TEST(Bench, EveryMountingHasAnErrorOfItsOwn) {
  BenchRig rig({});
  const Eigen::Vector3d first = rig.bench.true_gravity();
  rig.bench.turn(Eigen::Vector3d::UnitX());
  rig.finish();
  EXPECT_NEAR(rig.bench.true_gravity().norm(), 1, 1e-12);
  EXPECT_GT(rig.bench.true_gravity().x(), 0.999);
  rig.bench.turn(-Eigen::Vector3d::UnitZ());
  rig.finish();
  EXPECT_LT(rig.bench.true_gravity().z(), -0.999);
  EXPECT_GT((rig.bench.true_gravity() - first).norm(), 1e-4);
}

TEST(Bench, WhatIsThereIsTakenOffBeforeTheNextOrderIsBegun) {
  BenchRig rig(perfect());
  const double weight = 0.05 * rig.bench.settings().gravity;
  EXPECT_FALSE(rig.bench.busy());
  rig.bench.hang(0.05, kBolt);
  EXPECT_TRUE(rig.bench.busy());
  EXPECT_EQ(rig.wrench(), Vector6::Zero()) << "a person needs a moment";
  rig.finish();
  EXPECT_NEAR(rig.wrench()[2], -weight, 1e-6);
  rig.bench.turn(Eigen::Vector3d::UnitX());
  double most = 0;
  while (rig.bench.busy()) {
    rig.run(1e-3);
    if (rig.wrench().isZero(0)) continue;
    most = std::max(most, rig.bench.true_gravity().x());
  }
  EXPECT_LT(most, 1e-9) << "turned with the mass on";
  EXPECT_EQ(rig.wrench(), Vector6::Zero());
  rig.bench.hang(0.02, kBolt);
  rig.bench.hang(0.03, kBolt);  // thought better of it
  rig.finish();
  EXPECT_NEAR(rig.wrench()[0], 0.03 * rig.bench.settings().gravity, 1e-6);
  rig.bench.let_go();
  rig.finish();
  rig.run(0.01);
  EXPECT_EQ(rig.wrench(), Vector6::Zero());
  rig.bench.turn(Eigen::Vector3d::UnitY());
  rig.bench.turn(Eigen::Vector3d::UnitZ());  // and again
  rig.run(0.1);
  EXPECT_EQ(rig.bench.true_gravity(), Eigen::Vector3d(Eigen::Vector3d::UnitX()));
  double towards_y = 0;
  while (rig.bench.busy()) {
    rig.run(1e-2);
    towards_y = std::max(towards_y, rig.bench.true_gravity().y());
  }
  EXPECT_LT(towards_y, 1e-9);
  EXPECT_GT(rig.bench.true_gravity().z(), 1 - 1e-9);
}

TEST(Bench, LoadsComeAndGoWithoutAJump) {
  BenchRig rig({});
  const auto order = [&](int which) {
    if (which == 0) rig.bench.hang(0.05, kBolt);
    if (which == 1) rig.bench.push(kBolt, Eigen::Vector3d::UnitY(), 0.5, 3, 2);
    if (which == 2) rig.bench.turn({0, 1, 0});
    if (which == 3) rig.bench.move_about(Vector6::Constant(5e-3), 3);
    if (which == 4) rig.bench.let_go();
  };
  Vector6 before = Vector6::Zero();
  Eigen::Vector3d down = rig.bench.true_gravity();
  for (const int which : {0, 1, 0, 2, 0, 3, 1, 3, 0, 4}) {
    order(which);
    rig.watch(which % 2 == 0 ? 1.3 : 2.1, [&] {  // the next order comes amid this one
      EXPECT_LT((rig.wrench() - before).norm(), 5e-3) << "N in a millisecond at " << rig.time;
      EXPECT_LT((rig.bench.true_gravity() - down).norm(), 5e-3) << rig.time;
      before = rig.wrench();
      down = rig.bench.true_gravity();
    });
  }
}

TEST(Bench, TheSameQuestionHasTheSameAnswerAFramePeriodLater) {
  BenchRig rig({});
  rig.bench.push(kBolt, Eigen::Vector3d::UnitY(), 0.5, 3, 2);
  rig.run(1.5);
  const double time = rig.time - 0.03;
  const Vector6 wrench = rig.bench.wrench(time, Vector6::Zero());
  const double cell = rig.bench.cell_force(time);
  ASSERT_GT(cell, 0);
  rig.bench.hang(0.05, kBolt);
  rig.run(0.01);
  EXPECT_EQ(rig.bench.wrench(time, Vector6::Zero()), wrench);
  EXPECT_EQ(rig.bench.cell_force(time), cell);
}

TEST(Bench, WhatWasFeltIsRememberedBetweenTheStepsOfTheIntegration) {
  BenchRig rig({});
  rig.bench.push(kBolt, Eigen::Vector3d::UnitY(), 0.5, 3, 1);
  rig.run(2);
  for (double back = 1e-3; back < 0.15; back += 3.7e-3) {
    const double time = rig.time - back;
    EXPECT_LT((rig.bench.felt(time) - rig.motion.applied_wrench(time)).norm(), 1e-6) << back;
  }
  rig.run(3);
  EXPECT_NEAR(rig.bench.newest_felt(), rig.time, 1e-3);
  EXPECT_NEAR(rig.bench.newest_felt() - rig.bench.oldest_felt(), 2, 0.05) << "s of memory";
  EXPECT_EQ(rig.bench.felt(0), rig.bench.felt(rig.bench.oldest_felt()));
}

TEST(BenchFaults, TheWrongMassHangsOnce) {
  BenchSettings settings = perfect();
  settings.faults.wrong_mass = 2;
  settings.faults.wrong_mass_factor = 1.5;
  BenchRig rig(settings);
  for (const double factor : {1.0, 1.5, 1.0}) {
    rig.bench.hang(0.05, kBolt);
    rig.finish();
    EXPECT_NEAR(rig.wrench()[2], -factor * 0.05 * settings.gravity, 1e-6);
  }
}

TEST(BenchFaults, ABumpMovesTheRestForGoodAndNobodyAppliedIt) {
  BenchSettings settings = perfect();
  settings.faults.bump = 2;
  BenchRig rig(settings);
  rig.bench.let_go();
  rig.run(1);
  EXPECT_EQ(rig.displacement(), Vector6::Zero());
  rig.bench.let_go();
  rig.run(1);
  EXPECT_EQ(rig.displacement(), settings.faults.bump_change);
  EXPECT_EQ(rig.wrench(), Vector6::Zero());
}

TEST(BenchFaults, TheRestDriftsByTheHour) {
  BenchSettings settings = perfect();
  settings.faults.drift_per_hour = Vector6::Constant(36e-6);
  BenchRig rig(settings);
  rig.run(10);
  EXPECT_LT((rig.displacement() - Vector6::Constant(1e-7)).norm(), 1e-12);
}

}  // namespace
}  // namespace tagwrench::sim
