// Taps and twists on the puck -> buttons and commands.
//
// A gesture is made from rest, by a finger that comes out of the air: it is struck. A push is made
// by a hand that lies there already and sees the view move: it swells, and stays. So they are told
// apart by how they begin, how long they last and where they end, not by size alone:
//
//   tap          straight down, and off again within tap_longest
//   double tap   the next one begins within double_within of the end of the first
//   press-hold   struck straight down, and kept there, steadily
//   twist-click  turned about the vertical axis and back again within twist_longest
//
// From rest means: all axes within `quiet` for quiet_before. None is seen in a push, therefore, nor
// while it swings out; nor across a frame that is lost or saturated, or a gap between trustworthy
// ones longer than longest_gap. HID axes throughout: Z down, Mz clockwise as seen from above.
#pragma once

#include <Eigen/Core>
#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>

#include "host/core/types.h"
#include "host/motion/shaping.h"

namespace tagwrench {

enum class Gesture : std::uint8_t { none, tap, double_tap, press_hold, twist_left, twist_right };

constexpr const char* name(Gesture gesture) {
  constexpr std::array kNames = {"none",       "tap",        "double tap",
                                 "press-hold", "twist left", "twist right"};
  return kNames[static_cast<std::size_t>(gesture)];
}

enum class GestureCommand : std::uint8_t { none, zero, next_profile };

/// What a gesture does. One that does nothing is not looked for.
struct GestureAction {
  int button = -1;  ///< bit of Sample::buttons, 0..31; -1: none
  GestureCommand command = GestureCommand::none;

  constexpr bool does_something() const { return button >= 0 || command != GestureCommand::none; }
  bool operator==(const GestureAction&) const = default;
};

/// Loads of the published sensor (0.9, 0.9, 2.5 N, 16, 16, 9 mN m); gestures_for() scales them.
struct GestureOptions {
  /// Rows: HID X, Y, Z along the axes of the wrench.
  Eigen::Matrix3d hid_R_camera = ShapingOptions{}.hid_R_camera;

  double tap_force = 0.5;      ///< N, least peak of a tap
  double press_force = 1.0;    ///< N, least force of a press-hold
  double twist_torque = 3e-3;  ///< N m, least peak of a twist-click
  /// Largest load per axis that is rest, N and N m; at least four of the reading's sigmas.
  Vector6 quiet = (Vector6() << 0.054, 0.054, 0.15, 0.96e-3, 0.96e-3, 0.54e-3).finished();
  /// Largest load on the other axes during a twist-click, N and N m; the last one is of no use.
  Vector6 twist_others = (Vector6() << 0.27, 0.27, 0.75, 4.8e-3, 4.8e-3, 2.7e-3).finished();
  double tap_reach = 0.010;  ///< m, from the middle to where a tap or a press may land
  double tap_slant = 0.5;    ///< largest sideways force of a tap or a press, over the downward one

  Duration quiet_before = std::chrono::milliseconds(120);  ///< at rest, before a gesture begins
  Duration tap_longest = std::chrono::milliseconds(120);   ///< beyond `quiet`
  Duration shortest = std::chrono::milliseconds(35);  ///< from rest to rest; a knock is shorter
  Duration twist_longest = std::chrono::milliseconds(150);
  Duration settled = std::chrono::milliseconds(45);  ///< back where it was, at the end of a gesture
  Duration double_within = std::chrono::milliseconds(250);
  Duration press_rise = std::chrono::milliseconds(60);  ///< from `quiet` to 0.8 of where it stays
  Duration press_time = std::chrono::milliseconds(500);
  Duration longest_gap = std::chrono::milliseconds(60);  ///< between frames
  /// A button stays pressed so long, which a program that looks ten times a second sees. That of a
  /// press-hold stays as long as the finger does.
  Duration pressed = std::chrono::milliseconds(100);

  bool hold_motion = true;  ///< GestureResult::hold_motion is told; otherwise it is never true

  GestureAction tap;
  GestureAction double_tap;  ///< where it does something, a tap is told double_within later
  GestureAction press_hold;
  GestureAction twist_left;  ///< counter-clockwise as seen from above
  GestureAction twist_right;

  bool operator==(const GestureOptions&) const = default;
};

/// Loads scaled from the range of a sensor along the axes of its wrench, N and N m; an axis whose
/// range is not known keeps the default. Times stay, and no gesture does anything yet.
GestureOptions gestures_for(const Vector6& range,
                            const Eigen::Matrix3d& hid_R_camera = GestureOptions{}.hid_R_camera);

struct GestureResult {
  std::uint32_t buttons = 0;  ///< pressed now
  /// In one frame, once all axes have been at rest for quiet_before after the gesture: what is then
  /// taken for zero is nobody's hand.
  GestureCommand command = GestureCommand::none;
  Gesture recognised = Gesture::none;  ///< in the one frame that completes it
  /// The device should stay where it is: a gesture is going on, or may be. Never for a load that
  /// swells as a push does; for a push that is struck like a gesture, until it outlasts one.
  bool hold_motion = false;
};

/// Depends on samples and their times alone, so that a replay gives the same. No heap.
class Gestures {
 public:
  explicit Gestures(const GestureOptions& options) noexcept : options_(options) {}

  /// Of each sample, in the order of time, with its zero taken off.
  GestureResult feel(const Sample& sample) noexcept;

  const GestureOptions& options() const noexcept { return options_; }

 private:
  enum class Phase : std::uint8_t {
    unsettled,  ///< something else than a gesture goes on, or it was not yet at rest for long
    ready,      ///< at rest
    pulse,      ///< somebody has struck it
    landing,    ///< and has let go again
    between,    ///< was that the first of two taps?
    pressing,   ///< pressed steadily, not yet for long
    held,       ///< a press-hold
  };
  struct Reading {
    TimePoint time{};
    Vector6 load = Vector6::Zero();  ///< N and N m, HID axes
    bool saturated = false;
  };
  struct Force {
    TimePoint time{};
    double force = 0;  ///< N
  };
  /// What happens on one axis between rest and rest.
  struct Pulse {
    bool tap = false;      ///< may still be one, or a press
    bool twist = false;    ///< may still be one
    bool sudden = false;   ///< it grows so fast that motion is held back
    bool spoiled = false;  ///< held back, but never a gesture: the sensor was out of its range
    double sign = 1;       ///< of a twist
    TimePoint before{};    ///< the last frame at rest
    TimePoint begin{};     ///< the first frame beyond
    TimePoint left{};      ///< when it left rest, between those two
    TimePoint end{};       ///< the first frame back at rest
    double peak = 0;       ///< N or N m, along the pulse
    Vector6 most = Vector6::Zero();  ///< largest magnitudes
    std::array<Force, 32> rise{};    ///< its first frames
    std::size_t rise_count = 0;
    double landed_sum = 0;  ///< N or N m, along the pulse, of frames since its end
    int landed = 0;
  };

  bool looks_for_taps() const noexcept;
  bool looks_for_twists() const noexcept;
  bool at_rest(const Vector6& load, double part = 1) const noexcept {
    return (load.array().abs() <= part * band_.array()).all();
  }
  void step(const Reading& now) noexcept;
  void settle(const Reading& now) noexcept;
  void begin_pulse(const Reading& now, bool second) noexcept;
  void follow_pulse(const Reading& now) noexcept;
  double along(const Reading& now) const noexcept;
  bool over(const Reading& now) const noexcept;
  bool swings_too_far(const Reading& now) const noexcept;
  void choose(const Reading& now) noexcept;
  bool still_a_tap(const Reading& now) const noexcept;
  bool still_a_twist(const Reading& now) const noexcept;
  bool rises(const Reading& now, double value, double last, double force, double band,
             Duration longest) const noexcept;
  bool straight_down(double force) const noexcept;
  bool struck(double force) const noexcept;
  void end_pulse(const Reading& now) noexcept;
  void land(const Reading& now) noexcept;
  void landed(const Reading& now) noexcept;
  void await_second(const Reading& now) noexcept;
  void press(const Reading& now) noexcept;
  void keep_pressed(const Reading& now) noexcept;
  void complete(Gesture gesture, TimePoint now) noexcept;
  void give_up(const Reading& now) noexcept;
  void unsettle() noexcept {
    patience_ = options_.quiet_before;
    phase_ = Phase::unsettled;
    quiet_ = false;
    first_tap_ = false;
  }
  /// The other half of a double tap may come, and is to be no tap.
  void await_more() noexcept {
    if (options_.double_tap.does_something()) patience_ = options_.double_within;
  }
  /// Whatever went on, nobody saw how.
  void forget() noexcept {
    unsettle();
    await_more();
    held_button_ = 0;
    swings_ = false;
  }
  void begin_swing(TimePoint now) noexcept;

  GestureOptions options_;
  Phase phase_ = Phase::unsettled;
  bool started_ = false;
  Reading last_;
  Vector6 band_ = Vector6::Zero();  ///< of rest, by options and noise
  bool quiet_ = false;
  TimePoint quiet_since_{};
  Duration patience_ = options_.quiet_before;  ///< of rest, before the next gesture

  Vector6 baseline_ = Vector6::Zero();  ///< mean of what reads at rest
  Pulse pulse_;
  bool first_tap_ = false;  ///< there was one before this pulse
  double plateau_ = 0;      ///< N, of a press
  bool swings_ = false;     ///< the springs, after a gesture
  TimePoint swing_until_{};
  int calm_frames_ = 0;

  std::uint32_t buttons_ = 0;
  TimePoint release_at_{};
  std::uint32_t held_button_ = 0;
  GestureCommand wanted_ = GestureCommand::none;  ///< not yet given
  GestureResult result_;
};

}  // namespace tagwrench
