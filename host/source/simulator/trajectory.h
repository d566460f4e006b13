// What the user does to the platform, as a function of time.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>

#include "host/core/types.h"
#include "host/source/simulator/scenario.h"

namespace tagwrench::sim {

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
  Vector6 tap(double time) const noexcept;
  Vector6 compound(double time) const noexcept;
  Vector6 on_axis(double value) const noexcept;

  Trajectory trajectory_;
  std::uint64_t seed_;
  std::array<std::array<Tone, kTones>, 6> tones_{};
};

}  // namespace tagwrench::sim
