#include "host/source/simulator/trajectory.h"

#include <algorithm>
#include <cmath>
#include <numbers>

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

// Rises from 0 to 1 over [0, length] with no jump in the first two derivatives.
double smooth_step(double time, double length) {
  const double x = std::clamp(time / length, 0.0, 1.0);
  return x * x * x * (x * (6 * x - 15) + 10);
}

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
  if (phase - which * kEach < kStepOn) {
    wrench[which / 2] = (which % 2 == 0 ? 1 : -1) * trajectory_.amplitude[which / 2];
  }
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

Vector6 TrajectoryPlayer::tap(double time) const noexcept {
  return on_axis(kTapGain * half_sine(std::fmod(time, kTapEvery), kTapTime));
}

Vector6 TrajectoryPlayer::compound(double time) const noexcept {
  const double fade = smooth_step(time, 1.0);
  Vector6 wrench;
  for (int axis = 0; axis < 6; ++axis) {
    double sum = 0;
    for (const Tone& tone : tones_[axis]) {
      sum += tone.weight * std::sin(2 * pi * tone.frequency * time + tone.phase);
    }
    // The tones rarely agree; without the gain the hand would seldom reach half of the amplitude.
    wrench[axis] = fade * trajectory_.amplitude[axis] * std::tanh(1.5 * sum) / std::tanh(1.5);
  }
  return wrench;
}

Vector6 TrajectoryPlayer::applied_wrench(double absolute_time) const noexcept {
  const double time = absolute_time - trajectory_.rest_time;
  if (time < 0) return Vector6::Zero();
  switch (trajectory_.motion) {
    case Motion::push:
      return on_axis(held(time, trajectory_.hold_time));
    case Motion::steps:
      return steps(time);
    case Motion::sweep:
      return sweep(time);
    case Motion::tap:
      return tap(time);
    case Motion::compound:
      return compound(time);
    case Motion::hard:
      return hard(time);
    case Motion::hold:
      return 0.5 * held(time, trajectory_.hold_time) * Vector6::Map(trajectory_.amplitude.data());
    case Motion::rest:
    case Motion::drop:
    case Motion::desk:
      break;
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
  for (int axis = 0; axis < 6; ++axis) {
    event.wrench[axis] = trajectory_.amplitude[axis] * random.uniform(-1, 1);
  }
  switch (event.what) {
    case Event::sway:
      event.frequency = random.uniform(0.5, 8.0);
      event.wrench *= std::min(1.0, kFullSway / event.frequency);
      break;
    case Event::shove:
      event.wrench *= kShoveShare;
      break;
    case Event::tap:
      event.frequency = random.uniform(2.0, 8.0);
      event.wrench = event.wrench.cwiseProduct(Vector6::Map(kHardTapGain));
      break;
    case Event::rest:
    case Event::hold:
    case Event::drop:
      break;
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
    case Event::hold:
      return eased * event.wrench;
    case Event::sway:
      return eased * std::sin(2 * pi * event.frequency * local) * event.wrench;
    case Event::shove:
      return event.wrench;
    case Event::tap:
      return half_sine(std::fmod(local, 1 / event.frequency), kTapTime) * event.wrench;
    case Event::rest:
    case Event::drop:
      break;
  }
  return Vector6::Zero();
}

}  // namespace tagwrench::sim
