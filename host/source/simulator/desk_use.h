// An hour at the desk: somebody works in CAD with the puck, and the room lives along. Pushes in
// random directions, holding, resting, letting go at once, a hand that is laid on it, brushes, taps
// and twists that are meant, knocks at the table, and a rest position that wanders with the warmth.
// What was meant when is the truth to count against.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "host/source/simulator/mechanics.h"
#include "host/source/simulator/scenario.h"

namespace tagwrench::sim {

class Random;

enum class DeskDoing : std::uint8_t {
  rest,
  push,   ///< moves the view
  hand,   ///< lies on the puck and means nothing
  brush,  ///< a sleeve or a finger in passing
  knock,  ///< at the table; nobody touches the puck
  tap,
  double_tap,
  press_hold,
  twist_left,  ///< counter-clockwise as seen from above
  twist_right,
};

constexpr bool is_gesture(DeskDoing doing) { return doing >= DeskDoing::tap; }

/// One thing after the other, without overlap; s of simulation time.
struct DeskAct {
  DeskDoing what = DeskDoing::rest;
  double begin = 0;
  double end = 0;
  Vector6 peak = Vector6::Zero();    ///< N and N m about the platform's origin, camera axes
  Vector6 turned = Vector6::Zero();  ///< where a long push has gone by its end
  double rise = 0;       ///< s, of a push, a hand or a press; 0: one bell from begin to end
  double fall = 0;       ///< s
  double sharpness = 1;  ///< a tap's force is sin^sharpness of its phase
  double gap = 0;        ///< s between two taps; the first is as long as the second
  double tremor_hz = 0;
  double tremor = 0;  ///< share of the load
  double sway_hz = 0;
  double sway = 0;  ///< share of the load
  double phase = 0;
  double knock_at = 0;                                   ///< s
  double knock_length = 0;                               ///< s; 0: none
  Eigen::Vector3d knock_peak = Eigen::Vector3d::Zero();  ///< m/s^2
};

class DeskUse final : public AppliedLoad {
 public:
  /// By scenario.desk, trajectory.rest_time (nothing happens before), trajectory.amplitude (of the
  /// largest push), the sensor's range and stiffness, and the seed.
  explicit DeskUse(const Scenario& scenario);

  /// All of them, rests included, in order of time.
  const std::vector<DeskAct>& acts() const noexcept { return acts_; }
  /// Position in acts() of what goes on at `time`; the last one after the end.
  std::size_t act_at(double time) const noexcept;

  Vector6 wrench(double time, const Vector6& displacement) noexcept override;
  Eigen::Vector3d gravity_change(double time) noexcept override;
  Vector6 rest_change(double time) noexcept override;

 private:
  void plan(const Scenario& scenario);
  void add_rest(double seconds);
  DeskAct push(Random& random) const;
  DeskAct hand(Random& random) const;
  DeskAct brush(Random& random) const;
  DeskAct gesture(Random& random) const;
  Vector6 direction(Random& random) const;
  Vector6 finger(Random& random, double force) const;
  void add_knock(DeskAct& act, Random& random) const;

  DeskSettings settings_;
  Vector6 amplitude_;
  Vector6 range_;
  std::vector<DeskAct> acts_;
  mutable std::size_t last_ = 0;  ///< where act_at() looks first
  struct Wander {
    double hz = 0, phase = 0;
    Vector6 displacement = Vector6::Zero();  ///< m, rad
  };
  std::vector<Wander> wander_;
};

}  // namespace tagwrench::sim
