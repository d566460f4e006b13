// The platform on its springs: M d'' + C d' + K d = applied wrench + inertial load, in displacement
// coordinates.
//
// The springs' law is linear in the displacement (translation and rotation vector), and wrenches
// are taken about the platform origin at rest; so in equilibrium the applied wrench is K d exactly,
// whatever the size of the motion. Creep and friction, where the scenario has them, add
//   K (d - c) in place of K d, with c' = (share (d - c) - c) / time, and
//   a spring to a slider on each axis, which is dragged along where that spring would pull more
//   than the friction holds.
#pragma once

#include <vector>

#include "host/core/types.h"
#include "host/source/simulator/scenario.h"
#include "host/source/simulator/trajectory.h"

namespace tagwrench::sim {

// The light of an LED outside of the simulation: of a board, real, emulated or played.

class LedLight {
 public:
  LedLight() = default;
  LedLight(const LedLight&) = delete;
  LedLight& operator=(const LedLight&) = delete;
  virtual ~LedLight() = default;

  /// Mean brightness, 0 (off) to 1 (on all the time), from `from` to `to` seconds of the source's
  /// simulation time; at an instant if they are equal. Asked row by row, in the order of time but
  /// for the overlap of the rows' exposures: an emulated board may be run up to `to` on the spot.
  virtual double mean(double from, double to) noexcept = 0;
};

Eigen::Matrix<double, 4, 3> spring_centres(
    const Mechanics& mechanics);  ///< one row each, platform frame, m
Matrix6 stiffness(const Mechanics& mechanics);
Matrix6 inertia(const Mechanics& mechanics);
Matrix6 damping(const Mechanics& mechanics);

/// Displacement and its rate: m, rad, m/s, rad/s.
struct State {
  Vector6 displacement = Vector6::Zero();
  Vector6 rate = Vector6::Zero();
};

/// Integrates with a fixed step and keeps the last `memory` seconds, so that a camera can look at
/// any instant of its exposure.
class PlatformMotion {
 public:
  static constexpr double kStep =
      2.0e-4;  ///< s; the stiffest mode (about 90 Hz) turns 0.1 rad in it

  /// `load`, borrowed, acts in place of the player's wrench, if there is one.
  PlatformMotion(const Mechanics& mechanics, const TrajectoryPlayer& player, double start_time,
                 double memory, AppliedLoad* load = nullptr);

  /// Integrates until `time` is inside the memory. After a gap of more than two seconds (a
  /// suspended machine) the platform restarts in equilibrium, so that the cost of one call is
  /// bounded.
  void advance_to(double time) noexcept;

  /// The state at a time within the memory; outside of it, at its nearest end.
  State at(double time) const noexcept;

  /// The displacement there as it looks from the camera: with what no load made.
  Vector6 seen(double time) const noexcept;
  /// What the user applies there.
  Vector6 applied_wrench(double time) const noexcept;

  void set_state(const State& state) noexcept;
  const Matrix6& stiffness_matrix() const noexcept { return stiffness_; }

 private:
  Vector6 acceleration(const State& state, const Vector6& load) const noexcept;
  Vector6 load_at(double time, const Vector6& displacement) const noexcept;
  void relax() noexcept;
  void step() noexcept;
  void restart(double time) noexcept;

  Mechanics mechanics_;
  TrajectoryPlayer player_;
  AppliedLoad* applied_;
  Matrix6 stiffness_, damping_, inverse_inertia_;
  std::vector<State> ring_;
  long long newest_ = 0;  ///< step number; its state is ring_[newest_ % size]
  long long oldest_ = 0;
  double start_time_;
  Vector6 load_;                      ///< at the newest step
  Vector6 crept_ = Vector6::Zero();   ///< c
  Vector6 slider_ = Vector6::Zero();  ///< where it is held by friction
  Vector6 friction_spring_;           ///< N/m, N m/rad
  Vector6 friction_reach_;            ///< m, rad
};

}  // namespace tagwrench::sim
