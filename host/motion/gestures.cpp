#include "host/motion/gestures.h"

#include <algorithm>
#include <cmath>

#include "host/wrench/zero.h"

namespace tagwrench {
namespace {

constexpr int kDown = 2;  // HID axes: force towards the table
constexpr int kTurn = 5;  // and torque about it

constexpr double kNoiseSigmas = 4;     // of what counts as rest, at least
constexpr double kMaxBand = 0.5;       // of the least peak; where rest is wider, no gesture is told
constexpr double kTurnBack = 0.7;      // of the peak: a twist that is let go rings for longer
constexpr double kSwingBack = 0.5;     // of the peak: springs overshoot so much, a knock does more
constexpr double kSamePlace = 0.5;     // of `quiet`, between rest before and rest after
constexpr double kCalm = 0.5;          // of `quiet`, when the springs have swung out
constexpr int kCalmFrames = 2;         // in a row: one alone may be a passage through the middle
constexpr double kRiseTime = 1.0 / 3;  // of the longest gesture, from `quiet` to its least peak
constexpr double kBarely = 1.5;  // times what counts as rest: too little to tell how fast it grows
constexpr double kFirstRise = 0.5;     // of the rise asked for: it began somewhere between frames
constexpr double kMaxOfPlateau = 0.8;  // where the rise of a press ends
constexpr double kSteadyLow = 0.6;     // of the plateau
constexpr double kSteadyHigh = 1.5;
constexpr double kLetGo = 0.5;  // of press_force
constexpr auto kMaxSwing = std::chrono::milliseconds(150);
constexpr auto kStale = std::chrono::seconds(1);  // without numbers: a command from before is void
constexpr double kBaselineMemory = 0.1;           // s

double seconds(Duration time) { return std::chrono::duration<double>(time).count(); }

std::uint32_t bit(int button) {
  return button >= 0 && button < 32 ? std::uint32_t{1} << button : 0U;
}

}  // namespace

bool Gestures::looks_for_taps() const noexcept {
  const bool wanted = options_.tap.does_something() || options_.double_tap.does_something() ||
                      options_.press_hold.does_something();
  return wanted && band_[kDown] <= kMaxBand * options_.tap_force;
}

bool Gestures::looks_for_twists() const noexcept {
  const bool wanted = options_.twist_left.does_something() || options_.twist_right.does_something();
  return wanted && band_[kTurn] <= kMaxBand * options_.twist_torque;
}

GestureResult Gestures::feel(const Sample& sample) noexcept {
  result_ = {};
  if (!carries_numbers(sample.status) || !sample.wrench.allFinite()) {
    // Devices are neutral. A frame that is doubtful, as the blow of a finger may make it, is as
    // good as lost, and the frames around it tell; after anything worse what goes on is no gesture.
    buttons_ = held_button_ = 0;
    pulse_.spoiled = pulse_.spoiled || sample.status != Status::doubtful;
    if (phase_ == Phase::pressing || phase_ == Phase::held) unsettle();
    return {};
  }
  const bool late = started_ && sample.capture_time <= last_.time;  // a replay that jumps back
  const bool gap = started_ && sample.capture_time - last_.time > options_.longest_gap;
  if (late || gap || sample.touched) forget();
  if (started_ && sample.capture_time - last_.time > kStale) wanted_ = GestureCommand::none;

  const Reading now{sample.capture_time, turned(options_.hid_R_camera, sample.wrench),
                    sample.status == Status::saturated};
  if (phase_ == Phase::unsettled || phase_ == Phase::ready) {
    // Under load the sensor knows less; what rest is has been seen at rest.
    const Vector6 sigma = turned_sigma(options_.hid_R_camera, sample.wrench_sigma);
    band_ = options_.quiet.cwiseMax(kNoiseSigmas * sigma);
  }
  if (buttons_ != 0 && (late || now.time >= release_at_)) buttons_ = 0;
  step(now);
  if (swings_) {
    calm_frames_ = at_rest(now.load, kCalm) ? calm_frames_ + 1 : 0;
    if (calm_frames_ >= kCalmFrames || now.time >= swing_until_) swings_ = false;
  }
  last_ = now;
  started_ = true;

  const bool going_on = (phase_ == Phase::pulse && pulse_.sudden) || phase_ == Phase::landing ||
                        phase_ == Phase::pressing || phase_ == Phase::held;
  result_.hold_motion = options_.hold_motion && (going_on || swings_);
  result_.buttons = buttons_ | held_button_;
  return result_;
}

void Gestures::step(const Reading& now) noexcept {
  switch (phase_) {
    case Phase::unsettled:
    case Phase::ready: return settle(now);
    case Phase::pulse: return follow_pulse(now);
    case Phase::landing: return land(now);
    case Phase::between: return await_second(now);
    case Phase::pressing: return press(now);
    case Phase::held: return keep_pressed(now);
  }
}

void Gestures::settle(const Reading& now) noexcept {
  if (!at_rest(now.load)) {
    if (phase_ == Phase::ready) return begin_pulse(now, false);
    quiet_ = false;
    return;
  }
  if (!quiet_) {
    quiet_ = true;
    quiet_since_ = now.time;
    baseline_ = now.load;
  } else {
    // Without the newest frame: somebody may be about to strike.
    const double weight = 1 - std::exp(-seconds(now.time - last_.time) / kBaselineMemory);
    baseline_ += weight * (last_.load - baseline_);
  }
  if (phase_ == Phase::ready || now.time - quiet_since_ < patience_) return;
  phase_ = Phase::ready;
  result_.command = wanted_;
  wanted_ = GestureCommand::none;
}

void Gestures::begin_pulse(const Reading& now, bool second) noexcept {
  first_tap_ = second;
  pulse_ = {};
  pulse_.tap = looks_for_taps();
  pulse_.twist = !second && looks_for_twists();
  pulse_.sign = now.load[kTurn] < 0 ? -1 : 1;
  pulse_.before = last_.time;
  pulse_.begin = now.time;
  // Along a straight line between the two frames, on the axis that went farthest.
  Eigen::Index axis = kDown;
  if (!second) now.load.cwiseQuotient(band_).cwiseAbs().maxCoeff(&axis);
  const double from = std::abs(last_.load[axis]);
  const double way = std::abs(now.load[axis]) - from;
  const double share = way > 0 ? std::clamp((band_[axis] - from) / way, 0.0, 1.0) : 0.0;
  pulse_.left =
      last_.time +
      Duration(std::llround(share * static_cast<double>((now.time - last_.time).count())));
  phase_ = Phase::pulse;
  follow_pulse(now);
}

void Gestures::follow_pulse(const Reading& now) noexcept {
  Pulse& p = pulse_;
  p.spoiled = p.spoiled || now.saturated;
  p.most = p.most.cwiseMax(now.load.cwiseAbs());
  if (p.rise_count < p.rise.size()) p.rise[p.rise_count++] = {now.time, now.load[kDown]};
  if (over(now)) return end_pulse(now);
  p.tap = p.tap && still_a_tap(now);
  p.twist = p.twist && still_a_twist(now);
  if (!p.tap && !p.twist) {
    // After a tap it is a push, or a second tap that was seen badly: that shows soon.
    const bool soon = now.time - p.begin <= options_.tap_longest;
    if (first_tap_ && soon && now.load[kDown] > band_[kDown]) return;
    return give_up(now);
  }
  p.sudden = (p.tap && now.load[kDown] > kBarely * band_[kDown]) ||
             (p.twist && p.sign * now.load[kTurn] > kBarely * band_[kTurn]) || p.sudden;
  if (p.tap && p.twist) choose(now);
  if (p.tap && p.twist) return;
  p.peak = std::max(p.peak, along(now));
  if (!p.tap || now.time - p.begin <= options_.tap_longest) return;
  const bool pressed = options_.press_hold.does_something() && !p.spoiled && !first_tap_;
  if (!pressed || !struck(now.load[kDown])) return give_up(now);
  plateau_ = now.load[kDown];
  phase_ = Phase::pressing;
}

/// N or N m in the direction of the pulse.
double Gestures::along(const Reading& now) const noexcept {
  return pulse_.twist ? pulse_.sign * now.load[kTurn] : now.load[kDown];
}

/// Back at rest, after it was strong enough.
bool Gestures::over(const Reading& now) const noexcept {
  const double force = pulse_.twist ? options_.twist_torque : options_.tap_force;
  return (pulse_.tap || pulse_.twist) && pulse_.peak >= force &&
         along(now) <= band_[pulse_.twist ? kTurn : kDown];
}

/// Whether it swung back farther than springs do that were let go.
bool Gestures::swings_too_far(const Reading& now) const noexcept {
  const int axis = pulse_.twist ? kTurn : kDown;
  const double back = (pulse_.twist ? kTurnBack : kSwingBack) * pulse_.peak;
  return along(now) < -std::max(band_[axis], back);
}

/// A tap beside the middle turns it a little, and whoever turns it leans on it: what first is
/// strong enough is meant.
void Gestures::choose(const Reading& now) noexcept {
  const double tap = now.load[kDown] / options_.tap_force;
  const double twist = pulse_.sign * now.load[kTurn] / options_.twist_torque;
  if (std::max(tap, twist) < 1) return;
  (tap >= twist ? pulse_.twist : pulse_.tap) = false;
}

/// Whether it grows as fast as what is struck, or has been there.
bool Gestures::rises(const Reading& now, double value, double last, double force, double band,
                     Duration longest) const noexcept {
  if (std::max(pulse_.peak, value) >= force) return true;
  if (now.time - pulse_.begin > longest / 2) return false;
  if (now.time == pulse_.begin && value <= kBarely * band) return true;
  const double least =
      (force - band) / (kRiseTime * seconds(longest)) * (now.time == pulse_.begin ? kFirstRise : 1);
  return value - last >= least * seconds(now.time - last_.time);
}

bool Gestures::still_a_tap(const Reading& now) const noexcept {
  const double force = now.load[kDown];
  return force >= -band_[kDown] &&
         rises(now, force, last_.load[kDown], options_.tap_force, band_[kDown],
               options_.tap_longest) &&
         straight_down(std::max(pulse_.peak, force));
}

bool Gestures::still_a_twist(const Reading& now) const noexcept {
  const double torque = pulse_.sign * now.load[kTurn];
  const double size = std::min(1.0, std::max(pulse_.peak, torque) / options_.twist_torque);
  const Vector6 most = band_ + size * options_.twist_others;
  const bool others = (pulse_.most.head<kTurn>().array() <= most.head<kTurn>().array()).all();
  return others && torque >= -band_[kTurn] && now.time - pulse_.begin <= options_.twist_longest &&
         rises(now, torque, pulse_.sign * last_.load[kTurn], options_.twist_torque, band_[kTurn],
               options_.twist_longest);
}

/// What a finger does that comes from above, near the middle.
bool Gestures::straight_down(double force) const noexcept {
  const Vector6& most = pulse_.most;
  const double down = std::max(0.0, force);
  for (const int i : {0, 1}) {
    if (most[i] > options_.tap_slant * down + band_[i]) return false;
    if (most[i + 3] > options_.tap_reach * down + band_[i + 3]) return false;
  }
  return most[kTurn] <= options_.tap_slant * options_.tap_reach * down + options_.twist_torque;
}

/// A press whose force is where it stays: did it get there at once?
bool Gestures::struck(double force) const noexcept {
  if (force < options_.press_force) return false;
  const double level = kMaxOfPlateau * force;
  TimePoint before = pulse_.left;
  double from = 0;
  for (std::size_t i = 0; i < pulse_.rise_count; ++i) {
    const Force& frame = pulse_.rise[i];
    if (frame.force >= level) {
      const double share = (level - from) / (frame.force - from);
      const double rise = seconds(before - pulse_.left) + share * seconds(frame.time - before);
      return rise <= seconds(options_.press_rise);
    }
    before = frame.time;
    from = frame.force;
  }
  return false;
}

void Gestures::end_pulse(const Reading& now) noexcept {
  begin_swing(now.time);
  if (now.time - pulse_.before < options_.shortest || swings_too_far(now)) return give_up(now);
  pulse_.end = now.time;
  phase_ = Phase::landing;
}

void Gestures::land(const Reading& now) noexcept {
  Pulse& p = pulse_;
  const int axis = p.twist ? kTurn : kDown;
  if (swings_too_far(now)) return give_up(now);
  if (along(now) > (p.twist ? kTurnBack * p.peak : band_[axis])) {
    const bool second = p.tap && p.landed > 0 && !first_tap_ && !p.spoiled;
    if (second && options_.double_tap.does_something()) return begin_pulse(now, true);
    return give_up(now);
  }
  p.landed_sum += now.load[axis];
  ++p.landed;
  if (now.time - p.end >= options_.settled) landed(now);
}

/// Nothing lies on it that was not there before.
void Gestures::landed(const Reading& now) noexcept {
  const Pulse& p = pulse_;
  const int axis = p.twist ? kTurn : kDown;
  const double change = p.landed_sum / p.landed - baseline_[axis];
  if (p.spoiled || (p.tap && std::abs(change) > kSamePlace * band_[axis])) return give_up(now);
  if (p.twist) return complete(p.sign > 0 ? Gesture::twist_right : Gesture::twist_left, now.time);
  if (first_tap_) return complete(Gesture::double_tap, now.time);
  if (!options_.double_tap.does_something()) return complete(Gesture::tap, now.time);
  phase_ = Phase::between;
}

void Gestures::await_second(const Reading& now) noexcept {
  if (now.load[kDown] > band_[kDown]) return begin_pulse(now, true);
  if (now.time - pulse_.end > options_.double_within) complete(Gesture::tap, now.time);
}

void Gestures::press(const Reading& now) noexcept {
  const double force = now.load[kDown];
  pulse_.most = pulse_.most.cwiseMax(now.load.cwiseAbs());
  const bool steady = force >= kSteadyLow * plateau_ && force <= kSteadyHigh * plateau_ &&
                      force >= kLetGo * options_.press_force;
  if (now.saturated || !steady || !straight_down(force)) return give_up(now);
  if (now.time - pulse_.begin < options_.press_time) return;
  result_.recognised = Gesture::press_hold;
  held_button_ = bit(options_.press_hold.button);
  phase_ = Phase::held;
}

void Gestures::keep_pressed(const Reading& now) noexcept {
  if (now.load[kDown] >= kLetGo * options_.press_force) return;
  held_button_ = 0;
  wanted_ = options_.press_hold.command;
  begin_swing(now.time);
  unsettle();
}

void Gestures::complete(Gesture gesture, TimePoint now) noexcept {
  static constexpr std::array<GestureAction GestureOptions::*, 6> kActions = {
      nullptr,
      &GestureOptions::tap,
      &GestureOptions::double_tap,
      &GestureOptions::press_hold,
      &GestureOptions::twist_left,
      &GestureOptions::twist_right};
  unsettle();
  const GestureAction& does = options_.*kActions[static_cast<std::size_t>(gesture)];
  if (!does.does_something()) return;
  result_.recognised = gesture;
  wanted_ = does.command;
  if (does.button < 0) return;
  buttons_ |= bit(does.button);
  release_at_ = now + options_.pressed;
}

/// It is no gesture. If it is a push, a tap before it was one; if it is half a double tap, there is
/// none: less than what was meant may do what nobody wants.
void Gestures::give_up(const Reading& now) noexcept {
  const bool pushed = now.load[kDown] > band_[kDown];
  if (first_tap_ && pushed && !pulse_.spoiled) return complete(Gesture::tap, now.time);
  unsettle();
  if (!pushed) await_more();
}

void Gestures::begin_swing(TimePoint now) noexcept {
  swings_ = true;
  swing_until_ = now + kMaxSwing;
  calm_frames_ = 0;
}

GestureOptions gestures_for(const Vector6& range, const Eigen::Matrix3d& hid_R_camera) {
  GestureOptions options;
  options.hid_R_camera = hid_R_camera;
  const Vector6 felt = range_along(hid_R_camera, range);
  for (int i = 0; i < 6; ++i) {
    if (felt[i] <= 0) continue;
    options.quiet[i] = 0.06 * felt[i];
    options.twist_others[i] = 0.3 * felt[i];
  }
  if (felt[2] > 0) {
    options.tap_force = 0.2 * felt[2];
    options.press_force = 0.4 * felt[2];
  }
  if (felt[5] > 0) options.twist_torque = felt[5] / 3;
  return options;
}

}  // namespace tagwrench
