#include "host/source/simulator/trajectory.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "host/core/algebra/decompositions.h"
#include "host/source/simulator/mechanics.h"
#include "host/source/simulator/random.h"

namespace tagwrench::sim {
namespace {

using std::numbers::pi;
constexpr double kGravity = 9.81;          // m/s^2
constexpr double kRampTime = 0.3;          // s, a hand taking hold or letting go
constexpr double kStepOn = 1.0;            // s
constexpr double kStepOff = 0.5;           // s
constexpr double kTapEvery = 1.0;          // s
constexpr double kTapTime = 5.0e-3;        // s
constexpr double kTapGain = 2.0;           // times the amplitude
constexpr double kDropEvery = 3.0;         // s
constexpr double kFallTime = 0.35;         // s, from about 60 cm
constexpr double kImpactTime = 3.0e-3;     // s
constexpr double kImpactPeak = 30 * 9.81;  // m/s^2, half a sine
constexpr double kShoveShare = 0.3;        // of the amplitude, at once
constexpr double kFullSway = 1.5;          // Hz; faster ones are smaller, so that speeds stay alike
// Times the amplitude; what is stiffer takes a harder tap to move as far.
constexpr double kHardTapGain[6] = {0.4, 0.4, 2.0, 0.5, 0.5, 0.5};

double half_sine(double time, double length) {
  return time < 0 || time > length ? 0.0 : std::sin(pi * time / length);
}

// Acceleration of something that is let go at 0 and lands. The camera looks up: gravity points
// along -z. Rest includes gravity, so falling is seen as -g.
Eigen::Vector3d falling(double time) {
  const double fall = time >= 0 && time < kFallTime ? -kGravity : 0.0;
  const double impact = kImpactPeak * half_sine(time - kFallTime, kImpactTime);
  return {0.15 * impact, -0.1 * impact, fall + impact};
}

double held(double time, double hold_time) {
  const double on = smooth_step(time, kRampTime);
  return hold_time > 0 ? on - smooth_step(time - kRampTime - hold_time, kRampTime) : on;
}

constexpr double kBeforeGesture = 0.5;  // s of rest at least
constexpr double kAfterGesture = 0.8;
constexpr double kFingerReach = 6e-3;  // m from the middle

// 0 at the ends of [0, 1] and 1 in its middle: the speed of that movement.
double bell(double x) {
  x = std::clamp(x, 0.0, 1.0);
  return 16 * x * x * (1 - x) * (1 - x);
}

double beat(double time, double length, double sharpness) {
  if (time <= 0 || time >= length) return 0;
  return std::pow(std::sin(pi * time / length), sharpness);
}

double log_uniform(Random& random, double low, double high) {
  return low * std::pow(high / low, random.uniform());
}

double rest_length(Random& random) {
  const double kind = random.uniform();
  if (kind < 0.7) return random.uniform(0.2, 1.0);
  return kind < 0.95 ? random.uniform(1, 5) : random.uniform(5, 30);
}

void add_tremor(DeskAct& act, Random& random) {
  act.tremor_hz = random.uniform(8, 12);
  act.tremor = random.uniform(0.01, 0.05);
  act.sway_hz = random.uniform(0.3, 1.5);
  act.sway = random.uniform(0, 0.2);
  act.phase = random.uniform(0, 2 * pi);
}

/// Share of its peak that an act has reached, without tremor.
double strength(const DeskAct& act, double time) {
  const double since = time - act.begin;
  const double left = act.end - time;
  const double length = act.end - act.begin;
  switch (act.what) {
    case DeskDoing::rest:
    case DeskDoing::knock: return 0;
    case DeskDoing::push:
    case DeskDoing::hand:
    case DeskDoing::brush:
    case DeskDoing::press_hold:
      return act.rise > 0 ? smooth_step(since, act.rise) * smooth_step(left, act.fall)
                          : bell(since / length);
    case DeskDoing::double_tap: {
      const double each = 0.5 * (length - act.gap);
      return beat(since, each, act.sharpness) + beat(since - each - act.gap, each, act.sharpness);
    }
    case DeskDoing::tap:
    case DeskDoing::twist_left:
    case DeskDoing::twist_right: return beat(since, length, act.sharpness);
  }
  return 0;
}

}  // namespace

TrajectoryPlayer::TrajectoryPlayer(const Trajectory& trajectory, std::uint64_t seed)
    : trajectory_(trajectory), seed_(seed) {
  Random random(seed, kMotion);
  for (auto& axis : tones_) {
    double sum = 0;
    for (int i = 0; i < kTones; ++i) {
      // One tone in each fifth of the band, so that no two axes move alike and the band is filled.
      axis[i].frequency = trajectory.bandwidth * (i + random.uniform(0.3, 1.0)) / kTones;
      axis[i].phase = random.uniform(0, 2 * pi);
      axis[i].weight = random.uniform(0.5, 1.0);
      sum += axis[i].weight;
    }
    for (Tone& tone : axis) tone.weight /= sum;
  }
}

Vector6 TrajectoryPlayer::on_axis(double value) const noexcept {
  Vector6 wrench = Vector6::Zero();
  wrench[trajectory_.axis] = value * trajectory_.share * trajectory_.amplitude[trajectory_.axis];
  return wrench;
}

Vector6 TrajectoryPlayer::steps(double time) const noexcept {
  constexpr double kEach = kStepOn + kStepOff;
  const double phase = std::fmod(time, 12 * kEach);
  const int which = static_cast<int>(phase / kEach);
  Vector6 wrench = Vector6::Zero();
  if (phase - which * kEach < kStepOn)
    wrench[which / 2] = (which % 2 == 0 ? 1 : -1) * trajectory_.amplitude[which / 2];
  return wrench;
}

Vector6 TrajectoryPlayer::sweep(double time) const noexcept {
  // Logarithmic sweep: phase = 2 pi f0 T / ln(f1/f0) ((f1/f0)^(t/T) - 1).
  const double length = trajectory_.sweep_time;
  const double local = std::fmod(time, length);
  const double ratio = std::log(trajectory_.sweep_to / trajectory_.sweep_from);
  const double scale = trajectory_.sweep_from * length;
  const double turns = std::abs(ratio) < 1e-9 ? trajectory_.sweep_from * local
                                              : scale / ratio * std::expm1(ratio * local / length);
  const double fade = smooth_step(local, 0.5) * smooth_step(length - local, 0.5);
  return on_axis(fade * std::sin(2 * pi * turns));
}

Vector6 TrajectoryPlayer::compound(double time) const noexcept {
  const double fade = smooth_step(time, 1.0);
  Vector6 wrench;
  for (int axis = 0; axis < 6; ++axis) {
    double sum = 0;
    for (const Tone& tone : tones_[axis])
      sum += tone.weight * std::sin(2 * pi * tone.frequency * time + tone.phase);
    // The tones rarely agree; without the gain the hand would seldom reach half of the amplitude.
    wrench[axis] = fade * trajectory_.amplitude[axis] * std::tanh(1.5 * sum) / std::tanh(1.5);
  }
  return wrench;
}

Vector6 TrajectoryPlayer::applied_wrench(double absolute_time) const noexcept {
  const double time = absolute_time - trajectory_.rest_time;
  if (time < 0) return Vector6::Zero();
  switch (trajectory_.motion) {
    case Motion::push: return on_axis(held(time, trajectory_.hold_time));
    case Motion::steps: return steps(time);
    case Motion::sweep: return sweep(time);
    case Motion::tap: return on_axis(kTapGain * half_sine(std::fmod(time, kTapEvery), kTapTime));
    case Motion::compound: return compound(time);
    case Motion::hard: return hard(time);
    case Motion::hold:
      return 0.5 * held(time, trajectory_.hold_time) * Vector6::Map(trajectory_.amplitude.data());
    case Motion::rest:
    case Motion::drop:
    case Motion::desk: break;
  }
  return Vector6::Zero();
}

Eigen::Vector3d TrajectoryPlayer::base_acceleration(double absolute_time) const noexcept {
  const double time = absolute_time - trajectory_.rest_time;
  if (time < 0) return Eigen::Vector3d::Zero();
  if (trajectory_.motion == Motion::drop) return falling(std::fmod(time, kDropEvery));
  if (trajectory_.motion != Motion::hard) return Eigen::Vector3d::Zero();
  const HardEvent event = hard_event(time);
  return event.what == Event::drop ? falling(time - event.begin) : Eigen::Vector3d::Zero();
}

// Each event has a period of its own, begins in its first quarter and is over by its last tenth.
TrajectoryPlayer::HardEvent TrajectoryPlayer::hard_event(double time) const noexcept {
  const double period = trajectory_.event_time;
  const auto number = static_cast<std::uint64_t>(time / period);
  Random random = Random::numbered(seed_, kHardMotion, number);
  HardEvent event;
  event.what = kHardEvents[static_cast<std::size_t>(
      Random::shuffled(seed_, kHardMotionOrder, number, kHardEvents.size()))];
  event.begin = period * (static_cast<double>(number) + random.uniform(0, 0.25));
  event.length = period * random.uniform(0.3, 0.65);
  for (int axis = 0; axis < 6; ++axis)
    event.wrench[axis] = trajectory_.amplitude[axis] * random.uniform(-1, 1);
  switch (event.what) {
    case Event::sway:
      event.frequency = random.uniform(0.5, 8.0);
      event.wrench *= std::min(1.0, kFullSway / event.frequency);
      break;
    case Event::shove: event.wrench *= kShoveShare; break;
    case Event::tap:
      event.frequency = random.uniform(2.0, 8.0);
      event.wrench = event.wrench.cwiseProduct(Vector6::Map(kHardTapGain));
      break;
    case Event::rest:
    case Event::hold:
    case Event::drop: break;
  }
  return event;
}

Vector6 TrajectoryPlayer::hard(double time) const noexcept {
  const HardEvent event = hard_event(time);
  const double local = time - event.begin;
  const double left = event.length - local;
  if (local < 0 || left < 0) return Vector6::Zero();
  const double eased = smooth_step(local, kRampTime) * smooth_step(left, kRampTime);
  switch (event.what) {
    case Event::hold: return eased * event.wrench;
    case Event::sway: return eased * std::sin(2 * pi * event.frequency * local) * event.wrench;
    case Event::shove: return event.wrench;
    case Event::tap:
      return half_sine(std::fmod(local, 1 / event.frequency), kTapTime) * event.wrench;
    case Event::rest:
    case Event::drop: break;
  }
  return Vector6::Zero();
}

DeskUse::DeskUse(const Scenario& scenario)
    : settings_(scenario.desk),
      amplitude_(Vector6::Map(scenario.trajectory.amplitude.data())),
      range_(Vector6::Map(scenario.mechanics.range.data())) {
  plan(scenario);
  const Matrix6 stiffness_matrix = stiffness(scenario.mechanics);
  Random random = Random::numbered(scenario.seed, kDeskWander, 1);
  for (const double minutes : {random.uniform(20, 60), random.uniform(5, 12)}) {
    Vector6 way;
    for (int i = 0; i < 6; ++i) way[i] = random.uniform(-1, 1) * range_[i];
    way *= settings_.wander * (minutes < 15 ? 0.15 : 0.35);
    wander_.push_back(
        {1 / (60 * minutes), random.uniform(0, 2 * pi), Ldlt<6>(stiffness_matrix).solve(way)});
  }
}

void DeskUse::plan(const Scenario& scenario) {
  Random random = Random::numbered(scenario.seed, kDeskActs, 1);
  add_rest(scenario.trajectory.rest_time);
  const double end = scenario.trajectory.rest_time + settings_.length;
  bool after_gesture = false;
  while (acts_.back().end < end) {
    const double kind = random.uniform();
    const double others = 1 - settings_.gesture_share;
    DeskAct act;
    if (kind < settings_.gesture_share) {
      act = gesture(random);
    } else if (kind < settings_.gesture_share + 0.7 * others) {
      act = push(random);
    } else if (kind < settings_.gesture_share + 0.8 * others) {
      act = hand(random);
    } else if (kind < settings_.gesture_share + 0.93 * others) {
      act = brush(random);
    } else {
      act.what = DeskDoing::knock;
      act.end = 0.3;
      add_knock(act, random);
    }
    double rest = rest_length(random);
    if (is_gesture(act.what)) rest = std::max(rest, kBeforeGesture);
    if (after_gesture) rest = std::max(rest, kAfterGesture);
    add_rest(rest);
    const double begin = acts_.back().end;
    act.begin += begin;
    act.end += begin;
    act.knock_at += begin;
    acts_.push_back(act);
    after_gesture = is_gesture(act.what);
  }
  add_rest(1e9);
}

void DeskUse::add_rest(double seconds) {
  const double begin = acts_.empty() ? 0.0 : acts_.back().end;
  acts_.push_back({.begin = begin, .end = begin + seconds});
}

/// One axis, two of them, or all.
Vector6 DeskUse::direction(Random& random) const {
  Vector6 unit = Vector6::Zero();
  const double kind = random.uniform();
  const int axes = kind < 0.3 ? 1 : kind < 0.5 ? 2 : 6;
  for (int i = 0; i < axes; ++i) {
    const int axis = axes == 6 ? i : static_cast<int>(random.uniform(0, 6));
    unit[axis] = axes == 1 ? (random.uniform() < 0.5 ? -1 : 1) : random.uniform(-1, 1);
  }
  const double most = unit.cwiseAbs().maxCoeff();
  return most > 0 ? Vector6(unit / most) : unit;
}

DeskAct DeskUse::push(Random& random) const {
  DeskAct act{.what = DeskDoing::push, .end = log_uniform(random, 0.3, 8)};
  const double size = random.uniform(0.1, 1);
  act.peak = size * direction(random).cwiseProduct(amplitude_);
  act.turned = act.peak;
  add_tremor(act, random);
  if (act.end < 0.6 || (act.end < 1.5 && random.uniform() < 0.6)) return act;
  act.rise = random.uniform(0.15, 0.5);
  act.fall = random.uniform() < 0.25 ? random.uniform(5e-3, 15e-3) : random.uniform(0.12, 0.5);
  if (act.end < act.rise + act.fall) act.rise = act.fall = 0.5 * act.end;
  if (random.uniform() < 0.3) act.turned = size * direction(random).cwiseProduct(amplitude_);
  if (random.uniform() < 0.05) add_knock(act, random);
  return act;
}

DeskAct DeskUse::hand(Random& random) const {
  DeskAct act{.what = DeskDoing::hand, .end = random.uniform(1, 10)};
  act.peak = act.turned = finger(random, log_uniform(random, 0.012, 0.16) * range_[2]);
  act.rise = random.uniform(0.15, 0.4);
  act.fall = random.uniform(0.1, 0.3);
  add_tremor(act, random);
  return act;
}

DeskAct DeskUse::brush(Random& random) const {
  DeskAct act{.what = DeskDoing::brush, .end = random.uniform(0.1, 0.4)};
  act.peak = act.turned = random.uniform(0.05, 0.2) * direction(random).cwiseProduct(amplitude_);
  return act;
}

/// A finger from above presses near the middle, not quite straight.
Vector6 DeskUse::finger(Random& random, double force) const {
  const Eigen::Vector3d at{random.uniform(-kFingerReach, kFingerReach),
                           random.uniform(-kFingerReach, kFingerReach), 0};
  const Eigen::Vector3d push{random.uniform(-0.15, 0.15) * force,
                             random.uniform(-0.15, 0.15) * force, -force};
  Vector6 wrench;
  wrench << push, at.cross(push);
  return wrench;
}

DeskAct DeskUse::gesture(Random& random) const {
  DeskAct act;
  act.what = static_cast<DeskDoing>(static_cast<int>(DeskDoing::tap) +
                                    static_cast<int>(random.uniform(0, 5)));
  act.sharpness = random.uniform(1, 2);
  const double touch = random.uniform(0.05, 0.11);
  switch (act.what) {
    case DeskDoing::tap:
      act.end = touch;
      act.peak = finger(random, random.uniform(0.3, 0.8) * range_[2]);
      break;
    case DeskDoing::double_tap:
      act.gap = random.uniform(0.08, 0.2);
      act.end = 2 * touch + act.gap;
      act.peak = finger(random, random.uniform(0.3, 0.8) * range_[2]);
      break;
    case DeskDoing::press_hold:
      act.end = random.uniform(0.75, 2.0);
      act.peak = finger(random, random.uniform(0.5, 0.8) * range_[2]);
      act.rise = random.uniform(0.05, 0.09);
      act.fall = random.uniform(0.05, 0.12);
      act.tremor_hz = random.uniform(8, 12);
      act.tremor = random.uniform(0.01, 0.05);
      break;
    default: {
      act.end = random.uniform(0.08, 0.14);
      act.peak = finger(random, random.uniform(0, 0.12) * range_[2]);
      const double torque = random.uniform(0.45, 0.65) * range_[5];
      act.peak[5] = act.what == DeskDoing::twist_left ? torque : -torque;
    }
  }
  act.turned = act.peak;
  return act;
}

/// Most knocks are a cup that is set down; mainly up and down, as tables swing.
void DeskUse::add_knock(DeskAct& act, Random& random) const {
  act.knock_at = random.uniform(0, act.end);
  act.knock_length = random.uniform(4e-3, 15e-3);
  const double size = log_uniform(random, 0.05, 1) * settings_.knock;
  act.knock_peak = size * Eigen::Vector3d{random.uniform(-0.3, 0.3), random.uniform(-0.3, 0.3),
                                          random.uniform() < 0.5 ? -1.0 : 1.0};
}

std::size_t DeskUse::act_at(double time) const noexcept {
  while (last_ > 0 && time < acts_[last_].begin) --last_;
  while (last_ + 1 < acts_.size() && time >= acts_[last_].end) ++last_;
  return last_;
}

Vector6 DeskUse::wrench(double time, const Vector6& /*displacement*/) noexcept {
  const DeskAct& act = acts_[act_at(time)];
  const double share = strength(act, time);
  if (share <= 0) return Vector6::Zero();
  const double since = time - act.begin;
  const double gone = since / (act.end - act.begin);
  const double tremor = act.tremor * std::sin(2 * pi * act.tremor_hz * since + act.phase);
  const double sway = act.sway * std::sin(2 * pi * act.sway_hz * since);
  return share * (1 + tremor + sway) * ((1 - gone) * act.peak + gone * act.turned);
}

Eigen::Vector3d DeskUse::gravity_change(double time) noexcept {
  const DeskAct& act = acts_[act_at(time)];
  if (act.knock_length <= 0) return Eigen::Vector3d::Zero();
  return beat(time - act.knock_at, act.knock_length, 1) * act.knock_peak;
}

Vector6 DeskUse::rest_change(double time) noexcept {
  Vector6 sum = Vector6::Zero();
  for (const Wander& w : wander_)
    sum += (std::sin(2 * pi * w.hz * time + w.phase) - std::sin(w.phase)) * w.displacement;
  return sum;
}

}  // namespace tagwrench::sim
