#include "host/source/simulator/desk_use.h"

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
constexpr double kBeforeGesture = 0.5;  // s of rest at least
constexpr double kAfterGesture = 0.8;
constexpr double kFingerReach = 6e-3;  // m from the middle

// Rises from 0 to 1 over [0, 1]: the way of a minimum-jerk movement (Flash and Hogan, 1985).
double swell(double x) {
  x = std::clamp(x, 0.0, 1.0);
  return x * x * x * (x * (6 * x - 15) + 10);
}

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
    case DeskDoing::knock:
      return 0;
    case DeskDoing::push:
    case DeskDoing::hand:
    case DeskDoing::brush:
    case DeskDoing::press_hold:
      return act.rise > 0 ? swell(since / act.rise) * swell(left / act.fall) : bell(since / length);
    case DeskDoing::double_tap: {
      const double each = 0.5 * (length - act.gap);
      return beat(since, each, act.sharpness) + beat(since - each - act.gap, each, act.sharpness);
    }
    case DeskDoing::tap:
    case DeskDoing::twist_left:
    case DeskDoing::twist_right:
      return beat(since, length, act.sharpness);
  }
  return 0;
}

}  // namespace

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
  DeskAct rest;
  rest.begin = begin;
  rest.end = begin + seconds;
  acts_.push_back(rest);
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
  DeskAct act;
  act.what = DeskDoing::push;
  act.end = log_uniform(random, 0.3, 8);
  const double size = random.uniform(0.1, 1);
  act.peak = size * direction(random).cwiseProduct(amplitude_);
  act.turned = act.peak;
  add_tremor(act, random);
  if (act.end < 0.6 || (act.end < 1.5 && random.uniform() < 0.6)) return act;
  act.rise = random.uniform(0.15, 0.5);
  act.fall = random.uniform() < 0.25 ? random.uniform(5e-3, 15e-3) : random.uniform(0.12, 0.5);
  if (act.end < act.rise + act.fall) act.rise = act.fall = 0.5 * act.end;
  if (random.uniform() < 0.3) {
    act.turned = size * direction(random).cwiseProduct(amplitude_);
  }
  if (random.uniform() < 0.05) add_knock(act, random);
  return act;
}

DeskAct DeskUse::hand(Random& random) const {
  DeskAct act;
  act.what = DeskDoing::hand;
  act.end = random.uniform(1, 10);
  act.peak = act.turned = finger(random, log_uniform(random, 0.012, 0.16) * range_[2]);
  act.rise = random.uniform(0.15, 0.4);
  act.fall = random.uniform(0.1, 0.3);
  add_tremor(act, random);
  return act;
}

DeskAct DeskUse::brush(Random& random) const {
  DeskAct act;
  act.what = DeskDoing::brush;
  act.end = random.uniform(0.1, 0.4);
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
  for (const Wander& w : wander_) {
    sum += (std::sin(2 * pi * w.hz * time + w.phase) - std::sin(w.phase)) * w.displacement;
  }
  return sum;
}

}  // namespace tagwrench::sim
