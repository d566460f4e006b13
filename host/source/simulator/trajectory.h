// What the user does to the platform, as a function of time: the scenario's trajectory, or whoever
// else loads it, such as somebody at a desk.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "host/core/types.h"
#include "host/source/simulator/scenario.h"

namespace tagwrench::sim {

class Random;

/// Rises from 0 to 1 over [0, length] with no jump in the first two derivatives: the way of a
/// minimum-jerk movement (Flash and Hogan, 1985).
inline double smooth_step(double time, double length) noexcept {
  const double x = std::clamp(time / length, 0.0, 1.0);
  return x * x * x * (x * (6 * x - 15) + 10);
}

/// Someone outside the simulation who loads the platform, in place of the scenario's trajectory.
/// Asked at `time` seconds of the source's simulation time, in the order of time but for the
/// latest frame period: the integration runs ahead to the end of a frame's exposure, and the truth
/// of the frame is asked for afterwards. The same question has the same answer every time.
class AppliedLoad {
 public:
  AppliedLoad() = default;
  AppliedLoad(const AppliedLoad&) = delete;
  AppliedLoad& operator=(const AppliedLoad&) = delete;
  virtual ~AppliedLoad() = default;

  /// N and N m about the platform origin at rest, camera axes. `displacement` is the platform's
  /// just then (m, rad): what takes hold of a point moves with it. Asked several times a step of
  /// the integration.
  virtual Vector6 wrench(double time, const Vector6& displacement) noexcept = 0;

  /// Gravity now less gravity at time 0, m/s^2, camera axes: the platform's own weight pulls
  /// elsewhere when the sensor is held differently.
  virtual Eigen::Vector3d gravity_change(double /*time*/) noexcept {
    return Eigen::Vector3d::Zero();
  }

  /// By how much the platform seems displaced without any load (m, rad): the camera was knocked,
  /// the mount grew warm.
  virtual Vector6 rest_change(double /*time*/) noexcept { return Vector6::Zero(); }

  /// By how much a tag (position in target.tags) has slipped in its own plane: m along its x and
  /// y, rad about its z.
  virtual Eigen::Vector3d slip(int /*tag*/, double /*time*/) noexcept {
    return Eigen::Vector3d::Zero();
  }
};

/// The scenario's trajectory.
class TrajectoryPlayer {
 public:
  TrajectoryPlayer(const Trajectory& trajectory, std::uint64_t seed);

  /// What the user applies at `time` seconds after the start: N and N m about the platform origin
  /// at rest, camera axes.
  Vector6 applied_wrench(double time) const noexcept;

  /// Acceleration of the base and everything on it (m/s^2), beyond standing still; only a drop has
  /// any.
  Eigen::Vector3d base_acceleration(double time) const noexcept;

 private:
  static constexpr int kTones = 5;
  struct Tone {
    double frequency, phase, weight;
  };

  enum class Event : std::uint8_t { rest, hold, sway, shove, tap, drop };
  static constexpr std::array<Event, 10> kHardEvents = {
      Event::rest, Event::hold,  Event::hold, Event::hold, Event::sway,
      Event::sway, Event::shove, Event::tap,  Event::tap,  Event::drop};  ///< of one round
  /// One event of Motion::hard: what happens, when, and how.
  struct HardEvent {
    Event what = Event::rest;
    double begin = 0, length = 0;      ///< s, since the end of the first rest
    Vector6 wrench = Vector6::Zero();  ///< its largest, N and N m
    double frequency = 0;              ///< Hz: of a sway, or of taps
  };
  HardEvent hard_event(double time) const noexcept;
  Vector6 hard(double time) const noexcept;

  Vector6 steps(double time) const noexcept;
  Vector6 sweep(double time) const noexcept;
  Vector6 compound(double time) const noexcept;
  Vector6 on_axis(double value) const noexcept;

  Trajectory trajectory_;
  std::uint64_t seed_;
  std::array<std::array<Tone, kTones>, 6> tones_{};
};

// An hour at the desk: somebody works in CAD with the puck, and the room lives along. Pushes in
// random directions, holding, resting, letting go at once, a hand that is laid on it, brushes, taps
// and twists that are meant, knocks at the table, and a rest position that wanders with the warmth.
// What was meant when is the truth to count against.

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
