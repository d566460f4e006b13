#include "host/source/simulator/mechanics.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <numbers>

namespace tagwrench::sim {
namespace {

constexpr double kRunMemory_s = 0.01;

Trajectory at_rest() {
  Trajectory trajectory;
  trajectory.motion = Motion::rest;
  return trajectory;
}

Trajectory push(int axis, double share) {
  Trajectory trajectory;
  trajectory.motion = Motion::push;
  trajectory.axis = axis;
  trajectory.share = share;
  trajectory.rest_time = 0.1;
  return trajectory;
}

Vector6 settled(const Trajectory& trajectory, double time_s) {
  PlatformMotion motion(Mechanics{}, TrajectoryPlayer(trajectory, 1), 0, kRunMemory_s);
  for (double t = 0; t < time_s; t += 1) motion.advance_to(t);
  motion.advance_to(time_s);
  return motion.at(time_s).displacement;
}

TEST(Mechanics, SidewaysForceShiftsAndTiltsAsFourSpringsByHand) {
  // Four springs of 70 N/m give way sideways at mid-length, h = 25.4/2 - 1.8 = 10.9 mm on the lens
  // side of the origin. The force has the lever h about that height; the tilt about y stretches
  // springs at x = +-7.5 mm and bends all four.
  const double force = 0.4;
  Trajectory trajectory = push(0, 1.0);
  trajectory.amplitude[0] = force;
  const double h = 10.9e-3;
  const double tilt_stiffness = 4 * 700 * 7.5e-3 * 7.5e-3 + 4 * 3.23e-3;
  const double tilt = force * h / tilt_stiffness;
  const double shift = force / 280 + h * tilt;
  const Vector6 d = settled(trajectory, 3.0);
  constexpr double kTolerance_m = 1e-8;
  constexpr double kTolerance_rad = 1e-6;
  EXPECT_NEAR(d[0], shift, kTolerance_m);
  EXPECT_NEAR(d[4], tilt, kTolerance_rad);
  for (const int other : {1, 2}) EXPECT_NEAR(d[other], 0, kTolerance_m);
  for (const int other : {3, 5}) EXPECT_NEAR(d[other], 0, kTolerance_rad);
}

TEST(Mechanics, AxialForceAndTwistByHand) {
  constexpr double kTolerance_m = 1e-8;
  constexpr double kTolerance_rad = 1e-6;
  Trajectory axial = push(2, -1.0);
  axial.amplitude[2] = 1.4;
  EXPECT_NEAR(settled(axial, 3.0)[2], -1.4 / 2800, kTolerance_m);
  Trajectory twist = push(5, 1.0);
  twist.amplitude[5] = 4e-3;
  const double twist_stiffness = 4 * 70 * (7.5e-3 * 7.5e-3 + 6.5e-3 * 6.5e-3) + 4 * 3.71e-3;
  EXPECT_NEAR(settled(twist, 3.0)[5], 4e-3 / twist_stiffness, kTolerance_rad);
}

TEST(Mechanics, EveryAxisSettlesAtStiffnessInverseTimesWrench) {
  const Matrix6 k = stiffness(Mechanics{});
  EXPECT_TRUE(k.isApprox(k.transpose(), 1e-12));
  for (int axis = 0; axis < 6; ++axis) {
    Vector6 wrench = Vector6::Zero();
    const Trajectory trajectory = push(axis, 0.8);
    wrench[axis] = 0.8 * trajectory.amplitude[static_cast<std::size_t>(axis)];
    const Vector6 expected = k.inverse() * wrench;
    EXPECT_LT((settled(trajectory, 3.0) - expected).norm(), 1e-5 * expected.norm())
        << "axis " << axis;
  }
}

TEST(Mechanics, FreeOscillationHasThePeriodOfMassOnSpring) {
  Mechanics mechanics;
  mechanics.damping_ratio = 0;
  PlatformMotion motion(mechanics, TrajectoryPlayer(at_rest(), 1), 0, kRunMemory_s);
  State state;
  state.displacement[2] = 0.2e-3;
  motion.set_state(state);
  const double period =
      2 * std::numbers::pi * std::sqrt(mechanics.mass / (4 * mechanics.axial_stiffness));
  // Ten periods later it is back where it began, and a quarter later at zero.
  motion.advance_to(10 * period);
  constexpr double kTolerance_m = 0.5e-6;
  EXPECT_NEAR(motion.at(10 * period).displacement[2], 0.2e-3, kTolerance_m);
  motion.advance_to(10.25 * period);
  EXPECT_NEAR(motion.at(10.25 * period).displacement[2], 0, kTolerance_m);
}

TEST(Mechanics, EnergyDecaysAtTheDampingRatioAndIsKeptWithoutDamping) {
  for (const double ratio : {0.0, 0.05}) {
    Mechanics mechanics;
    mechanics.damping_ratio = ratio;
    PlatformMotion motion(mechanics, TrajectoryPlayer(at_rest(), 1), 0, kRunMemory_s);
    State state;
    state.displacement << 1e-3, -0.5e-3, 0.3e-3, 0.02, -0.03, 0.05;
    motion.set_state(state);
    const Matrix6 mass = inertia(mechanics);
    const auto energy_of = [&](const State& s) {  // kinetic plus elastic, J
      return 0.5 * s.rate.dot(mass * s.rate) +
             0.5 * s.displacement.dot(motion.stiffness_matrix() * s.displacement);
    };
    double energy = energy_of(state);
    const double at_start = energy;
    for (int i = 1; i <= 200; ++i) {
      motion.advance_to(i * 1e-3);
      const double now = energy_of(motion.at(i * 1e-3));
      EXPECT_LE(now, energy * (1 + 2e-4)) << "at " << i << " ms";
      energy = now;
    }
    constexpr double kRungeKuttaLoss = 0.02;  // of the energy, in 18 turns of the stiffest mode
    if (ratio == 0) {
      EXPECT_NEAR(energy, at_start, kRungeKuttaLoss * at_start);
    } else {
      EXPECT_LT(energy, 0.2 * at_start);
    }
  }
}

TEST(Mechanics, AxialRingingDecaysByTheLogarithmicDecrement) {
  const Mechanics mechanics;
  PlatformMotion motion(mechanics, TrajectoryPlayer(at_rest(), 1), 0, kRunMemory_s);
  State state;
  state.displacement[2] = 0.2e-3;
  motion.set_state(state);
  const double zeta = mechanics.damping_ratio;
  const double omega = std::sqrt(2800 / mechanics.mass);
  const double period = 2 * std::numbers::pi / (omega * std::sqrt(1 - zeta * zeta));
  motion.advance_to(3 * period);
  constexpr double kTolerance_m = 0.2e-6;
  EXPECT_NEAR(motion.at(3 * period).displacement[2], 0.2e-3 * std::exp(-zeta * omega * 3 * period),
              kTolerance_m);
}

TEST(Mechanics, HandMotionIsQuasiStatic) {
  const Trajectory trajectory;  // compound
  const TrajectoryPlayer player(trajectory, 1);
  PlatformMotion motion(Mechanics{}, player, 0, kRunMemory_s);
  Vector6 error = Vector6::Zero(), size = Vector6::Zero(), largest = Vector6::Zero();
  for (double t = 0; t < 40; t += 0.02) {
    motion.advance_to(t);
    const Vector6 wrench = player.applied_wrench(t);
    const Vector6 sprung = motion.stiffness_matrix() * motion.at(t).displacement;
    error += (sprung - wrench).cwiseAbs2();
    size += wrench.cwiseAbs2();
    largest = largest.cwiseMax(wrench.cwiseAbs());
  }
  for (int axis = 0; axis < 6; ++axis) {
    const double amplitude = trajectory.amplitude[static_cast<std::size_t>(axis)];
    EXPECT_LT(std::sqrt(error[axis] / size[axis]), 0.01) << "axis " << axis;
    EXPECT_GT(largest[axis], 0.6 * amplitude) << "axis " << axis;
    EXPECT_LE(largest[axis], amplitude) << "axis " << axis;
  }
}

TEST(Mechanics, StepRingsBeforeItSettles) {
  Trajectory trajectory;
  trajectory.motion = Motion::steps;
  trajectory.rest_time = 0;
  PlatformMotion motion(Mechanics{}, TrajectoryPlayer(trajectory, 1), 0, kRunMemory_s);
  const double x =
      (motion.stiffness_matrix().inverse() * Vector6::Unit(0))[0] * trajectory.amplitude[0];
  double overshoot = 0;
  for (double t = 0; t < 0.99; t += 1e-3) {
    motion.advance_to(t);
    overshoot = std::max(overshoot, motion.at(t).displacement[0] / x);
  }
  EXPECT_GT(overshoot, 1.5);  // a lightly damped mode nearly doubles a sudden step
  EXPECT_LT(overshoot, 2.0);
  constexpr double kTolerance_m = 0.02e-3;
  EXPECT_NEAR(motion.at(0.99).displacement[0], x, kTolerance_m);
}

TEST(Mechanics, FallingReleasesTheSagAndTheImpactRings) {
  Trajectory trajectory;
  trajectory.motion = Motion::drop;
  trajectory.rest_time = 0.5;
  const TrajectoryPlayer player(trajectory, 1);
  PlatformMotion motion(Mechanics{}, player, 0, kRunMemory_s);
  motion.advance_to(0.84);  // falling since 0.5 s, landing at 0.85 s
  constexpr double kTolerance_m = 0.5e-6;
  EXPECT_NEAR(motion.at(0.84).displacement[2], 0.010 * 9.81 / 2800, kTolerance_m);
  double deepest = 0;
  for (double t = 0.84; t < 0.9; t += 1e-3) {
    motion.advance_to(t);
    deepest = std::min(deepest, motion.at(t).displacement[2]);
    EXPECT_EQ(player.applied_wrench(t), Vector6::Zero());
  }
  EXPECT_LT(deepest, -0.5e-3);
}

TEST(Mechanics, AfterALongGapThePlatformRestartsInEquilibrium) {
  Trajectory trajectory = push(0, 1.0);
  PlatformMotion motion(Mechanics{}, TrajectoryPlayer(trajectory, 1), 0, kRunMemory_s);
  motion.advance_to(1e7);
  Vector6 wrench = Vector6::Zero();
  wrench[0] = trajectory.amplitude[0];
  const Vector6 expected = motion.stiffness_matrix().inverse() * wrench;
  EXPECT_LT((motion.at(1e7).displacement - expected).norm(), 1e-6 * expected.norm());
}

/// A load that is a function of time on one axis.
class OnAxis final : public AppliedLoad {
 public:
  OnAxis(int axis, double (*size)(double)) : axis_(axis), size_(size) {}
  Vector6 wrench(double time, const Vector6&) noexcept override {
    return size_(time) * Vector6::Unit(axis_);
  }

 private:
  int axis_;
  double (*size_)(double);
};

TEST(Mechanics, CreepGrowsByItsShareAtItsPaceUnderAConstantLoadAndGoesBack) {
  Mechanics mechanics;
  mechanics.creep_share = 0.05;
  mechanics.creep_time = 4;
  // 1.4 N from 0.1 s to 20.1 s.
  OnAxis load(2, [](double time) { return time > 0.1 && time < 20.1 ? 1.4 : 0.0; });
  PlatformMotion motion(mechanics, TrajectoryPlayer(at_rest(), 1), 0, kRunMemory_s, &load);
  const double elastic = 1.4 / 2800;
  constexpr double kTolerance_m = 0.1e-6;  // of 25 um of creep
  double at_release = 0;
  for (double t = 0.5; t < 30; t += 0.5) {
    motion.advance_to(t);
    const double z = motion.at(t).displacement[2];
    if (t >= 2 && t < 20.1) {  // the ringing is over
      const double crept = at_release = 0.05 * elastic * (1 - std::exp(-(t - 0.1) / 4));
      EXPECT_NEAR(z, elastic + crept, kTolerance_m) << t;
    } else if (t > 22) {
      EXPECT_NEAR(z, at_release * std::exp(-(t - 20.1) / 4), kTolerance_m) << t;
    }
  }
}

TEST(Mechanics, FrictionHoldsBackComingAndGoing) {
  Mechanics mechanics;
  mechanics.friction = 0.01;
  // A slow triangle between +-1.25 N, half of the range.
  OnAxis load(2, [](double time) {
    const double phase = std::fmod(time, 20.0);
    return phase < 10 ? -1.25 + 0.25 * phase : 3.75 - 0.25 * phase;
  });
  PlatformMotion motion(mechanics, TrajectoryPlayer(at_rest(), 1), 0, kRunMemory_s, &load);
  const double held = 0.01 * mechanics.range[2];  // N
  for (double t = 0.5; t < 45; t += 0.5) {
    motion.advance_to(t);
    const double phase = std::fmod(t, 20.0);
    const double force = load.wrench(t, {})[2];
    const double sprung = 2800 * motion.at(t).displacement[2];
    EXPECT_LT(std::abs(sprung - force), held * 1.02) << t;
    // In the middle of each stroke all of the friction is there: 1.25 N are five times its travel.
    if (t > 20 && std::abs(force) < 0.5) {
      EXPECT_NEAR(sprung - force, phase < 10 ? -held : held, 0.02 * held) << t;
    }
  }
}

}  // namespace
}  // namespace tagwrench::sim
