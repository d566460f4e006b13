#include "host/source/simulator/bench.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "host/source/simulator/mechanics.h"
#include "host/source/simulator/random.h"

namespace tagwrench::sim {
namespace {

using std::numbers::pi;
constexpr double kMaxSigmas = 3;
constexpr double kKnock = 0.05;        // s that a bump or a slip takes
constexpr double kHandEase = 0.5;      // s to take hold of the platform and to let it go
constexpr double kFirstStep = 2.0e-4;  // s between felt wrenches, nominal
constexpr double kOvalSwing = 0.5;     // of a swing: its small axis over the large one

// Nobody who measures leaves an error of more than three standard deviations unnoticed.
double error(Random& random, double sigma) {
  double value = random.normal();
  while (std::abs(value) > kMaxSigmas) value = random.normal();
  return sigma * value;
}

Eigen::Vector3d errors(Random& random, double sigma) {
  const double x = error(random, sigma);
  const double y = error(random, sigma);
  return {x, y, error(random, sigma)};
}

// A unit vector turned about each of two axes across it.
Eigen::Vector3d tilted(const Eigen::Vector3d& line, double first, double second) {
  const Eigen::Vector3d across = line.unitOrthogonal();
  const Eigen::Vector3d other = line.cross(across);
  return (line + std::tan(first) * across + std::tan(second) * other).normalized();
}

std::uint64_t whole(double value, double unit) {
  return static_cast<std::uint64_t>(std::llround(value / unit));
}

BenchSettings effective(BenchSettings settings) {
  if (!settings.perfect) return settings;
  settings.errors = {0, 0, 0, 0, 0, 0, 0, 0, 0};
  settings.times.swing_rad = 0;
  settings.load_cell.ideal = settings.six_axis.ideal = true;
  return settings;
}

constexpr double kFilterStep = 1e-3;         // s
constexpr double kStepVariance = 1.0 / 12;   // of whole counts, counts^2 (uniform)
constexpr double kMaxCounts = 32767;         // of a 16-bit reading
constexpr std::uint64_t kScale = 1'000'001;  // numbers of the seeds' streams, as kFirstTick
constexpr std::uint64_t kPlace = 1'000'002;

double sign(const ReferenceFaults& faults) { return faults.wrong_sign ? -1 : 1; }

}  // namespace

Bench::Bench(const BenchSettings& settings, std::uint64_t seed)
    : settings_(effective(settings)),
      seed_(seed),
      felt_(static_cast<std::size_t>(kMemory / kFirstStep)) {
  gravity_at_start_ = mounted(-Eigen::Vector3d::UnitZ());
  for (Turn& turn : turns_) turn.from = turn.to = gravity_at_start_;
}

// Orders.

double Bench::begin_order() noexcept {
  ++orders_;
  if (orders_ == settings_.faults.bump) bump_time_ = newest_;
  if (orders_ == settings_.faults.slip) slip_time_ = newest_;
  const double now = newest_ + settings_.times.reaction;
  double free = std::max(now, turns_[1].begin + settings_.times.turn);
  for (Action& action : actions_) {
    if (action.what == What::nothing) continue;
    if (action.begin >= now) {
      action = {};  // given up before it was begun
      continue;
    }
    action.end = std::min(action.end, now);
    free = std::max(free, action.end + action.ease_out);
  }
  done_ = free;
  return free;
}

Bench::Action& Bench::add(What what, double begin) noexcept {
  Action& action = actions_[acts_ % kActions];
  action = {};
  action.what = what;
  action.number = acts_++;
  action.begin = begin;
  action.ease_in = action.ease_out = settings_.times.load;
  Random random = Random::numbered(seed_, kBenchAction, action.number);
  for (double& frequency : action.sway_hz) frequency = random.uniform(0.3, 0.8);
  for (double& phase : action.sway_phase) phase = random.uniform(0, 2 * pi);
  action.tremor_hz = random.uniform(8, 12);
  action.tremor_phase = random.uniform(0, 2 * pi);
  return action;
}

void Bench::turn(const Eigen::Vector3d& gravity) noexcept {
  const double begin = begin_order();
  if (turns_[1].begin <= newest_) turns_[0] = turns_[1];
  turns_[1] = {begin, turns_[0].to, mounted(gravity.normalized())};
  done_ = begin + settings_.times.turn;
}

void Bench::hang(double mass, const Eigen::Vector3d& point) noexcept {
  Action& action = add(What::mass, begin_order());
  ++masses_;
  action.size = true_mass(mass);
  if (masses_ == settings_.faults.wrong_mass) action.size *= settings_.faults.wrong_mass_factor;
  Random random = Random::numbered(seed_, kBenchString, action.number);
  for (double& lean : action.lean) lean = error(random, settings_.errors.lean_rad);
  action.size += error(random, settings_.errors.string) / settings_.gravity;
  action.point = touched(point, action.number);
  done_ = action.begin + action.ease_in;
}

void Bench::push(const Eigen::Vector3d& point, const Eigen::Vector3d& direction, double peak,
                 double seconds, int strokes) noexcept {
  Action& action = add(What::push, begin_order());
  action.length = seconds;
  action.end = action.begin + seconds;
  action.strokes = std::max(1, strokes);
  action.size = peak;
  action.point = touched(point, action.number);
  Random random = Random::numbered(seed_, kBenchHand, action.number);
  const double first = error(random, settings_.errors.direction_rad);
  action.direction =
      tilted(direction.normalized(), first, error(random, settings_.errors.direction_rad));
  done_ = action.end;
}

void Bench::move_about(const Vector6& amplitude, double seconds, double bandwidth) noexcept {
  Action& action = add(What::hand, begin_order());
  action.ease_in = action.ease_out = kHandEase;
  action.length = seconds;
  action.end = action.begin + std::max(0.0, seconds - kHandEase);
  Trajectory trajectory;
  trajectory.motion = Motion::compound;
  trajectory.rest_time = 0;
  trajectory.bandwidth = bandwidth;
  Vector6::Map(trajectory.amplitude.data()) = amplitude;
  action.hand.emplace(trajectory, Random::numbered(seed_, kBenchHand, action.number).next());
  done_ = action.end + action.ease_out;
}

// Errors.

double Bench::true_mass(double mass) const noexcept {
  Random random = Random::numbered(seed_, kBenchMass, whole(mass, 1e-6));
  return mass * (1 + error(random, settings_.errors.mass));
}

Eigen::Vector3d Bench::true_point(const Eigen::Vector3d& point) const noexcept {
  const std::uint64_t which =
      (whole(point.x(), 1e-6) * 1'000'003 + whole(point.y(), 1e-6)) * 1'000'003 +
      whole(point.z(), 1e-6);
  Random random = Random::numbered(seed_, kBenchPoint, which);
  return point + errors(random, settings_.errors.point);
}

Eigen::Vector3d Bench::touched(const Eigen::Vector3d& point, std::uint64_t number) const noexcept {
  Random random = Random::numbered(seed_ + 1, kBenchPoint, number);
  return true_point(point) + errors(random, settings_.errors.contact);
}

Eigen::Vector3d Bench::mounted(const Eigen::Vector3d& gravity) noexcept {
  Random random = Random::numbered(seed_, kBenchMounting, mountings_++);
  const double first = error(random, settings_.errors.gravity_rad);
  return tilted(gravity, first, error(random, settings_.errors.gravity_rad));
}

// What there is at a time.

Eigen::Vector3d Bench::gravity(double time) const noexcept {
  const Turn& turn = time < turns_[1].begin ? turns_[0] : turns_[1];
  const double share = smooth_step(time - turn.begin, settings_.times.turn);
  if (share >= 1) return turn.to;
  const double cosine = std::clamp(turn.from.dot(turn.to), -1.0, 1.0);
  const Eigen::Vector3d off = turn.to - cosine * turn.from;
  const Eigen::Vector3d across =
      off.norm() > 1e-6 ? Eigen::Vector3d(off.normalized()) : turn.from.unitOrthogonal();
  const double angle = share * std::acos(cosine);
  return std::cos(angle) * turn.from + std::sin(angle) * across;
}

/// 0: not touched, 1: all of the load is there.
double Bench::hands(const Action& action, double time) const noexcept {
  return smooth_step(time - action.begin, action.ease_in) *
         (1 - smooth_step(time - action.end, action.ease_out));
}

double Bench::tremor(const Action& action, double time) const noexcept {
  return 1 + std::numbers::sqrt2 * settings_.errors.tremor *
                 std::sin(2 * pi * action.tremor_hz * time + action.tremor_phase);
}

double Bench::push_force(const Action& action, double time) const noexcept {
  const double local = time - action.begin;
  if (local <= 0 || local >= action.length) return 0;
  const double strokes = local / action.length * action.strokes;
  const auto stroke = static_cast<std::uint64_t>(strokes);
  Random random = Random::numbered(seed_, kBenchStroke, action.number * 1000 + stroke);
  const double share = random.uniform(0.75, 0.95);
  const double phase = std::pow(strokes - static_cast<double>(stroke), random.uniform(0.8, 1.25));
  const double sine = std::sin(pi * phase);
  const double released = 1 - smooth_step(time - action.end, action.ease_out);
  return action.size * share * sine * sine * tremor(action, time) * released;
}

Eigen::Vector3d Bench::push_direction(const Action& action, double time) const noexcept {
  const double amplitude = std::numbers::sqrt2 * settings_.errors.sway_rad;
  const auto sway = [&](std::size_t axis) {
    return amplitude * std::sin(2 * pi * action.sway_hz[axis] * time + action.sway_phase[axis]);
  };
  return tilted(action.direction, sway(0), sway(1));
}

/// A spherical pendulum of small swings, each along its own axis: angle a exp(-t / T) cos(w t).
Eigen::Vector3d Bench::string_pull(const Action& action, double time) const noexcept {
  const BenchTimes& times = settings_.times;
  const double rate = std::sqrt(settings_.gravity / times.string_length);
  const double local = std::max(0.0, time - action.begin - action.ease_in);  // held until let go
  const double left = times.swing_rad * std::exp(-local / times.swing_decay);
  const double sine = std::sin(rate * local);
  const double cosine = std::cos(rate * local);
  const double first = left * cosine;
  const double second = kOvalSwing * left * sine;
  const double first_rate = local > 0 ? -left * rate * sine - first / times.swing_decay : 0;
  const double second_rate =
      local > 0 ? kOvalSwing * left * rate * cosine - second / times.swing_decay : 0;
  const Eigen::Vector3d down = gravity(time);
  const Eigen::Vector3d string = tilted(down, action.lean[0] + first, action.lean[1] + second);
  const double tension =
      settings_.gravity * string.dot(down) +
      times.string_length * (first_rate * first_rate + second_rate * second_rate);
  return action.size * hands(action, time) * tension * string;
}

Vector6 Bench::wrench_of(const Action& action, double time,
                         const Vector6& displacement) const noexcept {
  if (time <= action.begin) return Vector6::Zero();
  if (action.what == What::hand) {
    if (time > action.end + action.ease_out) return Vector6::Zero();
    return hands(action, time) * tremor(action, time) *
           action.hand->applied_wrench(time - action.begin);
  }
  const Eigen::Vector3d force =
      action.what == What::mass
          ? string_pull(action, time)
          : Eigen::Vector3d(push_force(action, time) * push_direction(action, time));
  const Eigen::Vector3d point =
      displacement.head<3>() + rotation_matrix(displacement.tail<3>()) * action.point;
  Vector6 wrench;
  wrench << force, point.cross(force);
  return wrench;
}

Vector6 Bench::wrench(double time, const Vector6& displacement) noexcept {
  Vector6 sum = Vector6::Zero();
  for (const Action& action : actions_)
    if (action.what != What::nothing) sum += wrench_of(action, time, displacement);
  remember(time, sum);
  pass(time);
  return sum;
}

Eigen::Vector3d Bench::gravity_change(double time) noexcept {
  return settings_.gravity * (gravity(time) - gravity_at_start_);
}

Vector6 Bench::rest_change(double time) noexcept {
  const BenchFaults& faults = settings_.faults;
  return std::max(0.0, time) / 3600 * faults.drift_per_hour +
         smooth_step(time - bump_time_, kKnock) * faults.bump_change;
}

Eigen::Vector3d Bench::slip(int tag, double time) noexcept {
  if (tag != settings_.faults.slip_tag) return Eigen::Vector3d::Zero();
  return smooth_step(time - slip_time_, kKnock) * settings_.faults.slip_change;
}

// What reference instruments feel.

double Bench::cell_force(double time) const noexcept {
  double sum = 0;
  for (const Action& action : actions_)
    if (action.what == What::push) sum += push_force(action, time);
  return sum;
}

void Bench::remember(double time, const Vector6& wrench) noexcept {
  if (felt_count_ > 0 && time < felt_at(felt_count_ - 1).time + kFeltStep) return;
  felt_[felt_count_ % felt_.size()] = {time, wrench};
  ++felt_count_;
}

Vector6 Bench::felt(double time) const noexcept {
  if (felt_count_ == 0) return Vector6::Zero();
  std::uint64_t low = felt_count_ - std::min<std::uint64_t>(felt_count_, felt_.size());
  std::uint64_t high = felt_count_ - 1;
  if (time <= felt_at(low).time) return felt_at(low).wrench;
  if (time >= felt_at(high).time) return felt_at(high).wrench;
  while (high - low > 1) {
    const std::uint64_t middle = low + (high - low) / 2;
    (felt_at(middle).time <= time ? low : high) = middle;
  }
  const Felt& a = felt_at(low);
  const Felt& b = felt_at(high);
  return a.wrench + (time - a.time) / (b.time - a.time) * (b.wrench - a.wrench);
}

SimulatedLoadCell::SimulatedLoadCell(const Bench& bench)
    : bench_(bench),
      settings_(bench.settings().load_cell),
      ticks_(settings_.rate, bench.seed(), kLoadCell, settings_.faults),
      random_(bench.seed(), kLoadCell) {
  if (!settings_.ideal) {
    Random once = Random::numbered(bench.seed(), kLoadCell, kScale);
    scale_ += settings_.scale_error * std::clamp(once.normal(), -3.0, 3.0);
  }
}

bool SimulatedLoadCell::next(SimulatedReading& reading) noexcept {
  while (ticks_.time() <= bench_.newest() && ticks_.silent()) ticks_.advance();
  if (ticks_.time() > bench_.newest()) return false;
  reading = {};
  reading.time = ticks_.stamp();
  reading.axes = 1;
  if (settings_.ideal) {
    reading.value[0] = sign(settings_.faults) * bench_.cell_force(ticks_.time());
  } else {
    const double per_newton = settings_.counts_per_newton;
    const double force = sign(settings_.faults) * bench_.cell_force(ticks_.time() - settings_.lag);
    reading.saturated = std::abs(force) > settings_.range;
    const double shown = std::clamp(force, -settings_.range, settings_.range) * scale_ +
                         settings_.noise * random_.normal();
    reading.value[0] = std::round(shown * per_newton) / per_newton;
    reading.sigma[0] = std::hypot(settings_.noise, std::sqrt(kStepVariance) / per_newton);
  }
  ticks_.advance();
  return true;
}

SimulatedSixAxis::SimulatedSixAxis(const Bench& bench)
    : bench_(bench),
      settings_(bench.settings().six_axis),
      ticks_(settings_.rate, bench.seed(), kSixAxis, settings_.faults),
      random_(bench.seed(), kSixAxis),
      delay_(std::max(0.0, settings_.lag - 0.5 / (std::numbers::pi * settings_.filter_hz))),
      origin_(settings_.origin) {
  if (settings_.ideal) return;
  Random once = Random::numbered(bench.seed(), kSixAxis, kPlace);
  const auto off = [&once](double sigma) { return sigma * std::clamp(once.normal(), -3.0, 3.0); };
  for (double& coordinate : origin_) coordinate += off(settings_.place_error);
  Eigen::Vector3d turn;
  for (double& angle : turn) angle = off(settings_.turn_error);
  reference_R_platform_ = rotation_matrix(turn);
}

/// y' = (x - y) / tau, exact for an x that stays over a step.
void SimulatedSixAxis::filter_to(double time) noexcept {
  filtered_to_ = std::max(filtered_to_, bench_.oldest_felt());
  const double tau = 0.5 / (std::numbers::pi * settings_.filter_hz);
  while (filtered_to_ < time) {
    const double step = std::min(kFilterStep, time - filtered_to_);
    const Vector6 load = bench_.felt(filtered_to_ + 0.5 * step);
    filtered_ += (1 - std::exp(-step / tau)) * (load - filtered_);
    filtered_to_ += step;
  }
}

bool SimulatedSixAxis::next(SimulatedReading& reading) noexcept {
  const double lag = settings_.ideal ? 0 : delay_;
  const auto skip = [&] { return ticks_.silent() || ticks_.time() - lag < bench_.oldest_felt(); };
  while (ticks_.time() <= bench_.newest() && skip()) ticks_.advance();
  if (ticks_.time() > bench_.newest()) return false;
  if (!settings_.ideal) filter_to(ticks_.time() - delay_);
  const Vector6 load = settings_.ideal ? bench_.felt(ticks_.time()) : filtered_;
  const Eigen::Vector3d force = reference_R_platform_ * load.head<3>();
  const Eigen::Vector3d torque =
      reference_R_platform_ * (load.tail<3>() - origin_.cross(load.head<3>()));
  reading = {};
  reading.time = ticks_.stamp();
  reading.axes = 6;
  for (std::size_t i = 0; i < 6; ++i) {
    const auto axis = static_cast<int>(i % 3);
    double value = sign(settings_.faults) * (i < 3 ? force[axis] : torque[axis]);
    if (!settings_.ideal) {
      const double per_unit = settings_.counts_per_unit[i];
      const double most = std::min(settings_.range[i], kMaxCounts / per_unit);
      reading.saturated = reading.saturated || std::abs(value) > most;
      value = std::clamp(value, -most, most) + settings_.noise_counts / per_unit * random_.normal();
      value = std::round(value * per_unit) / per_unit;
      reading.sigma[i] =
          std::sqrt(settings_.noise_counts * settings_.noise_counts + kStepVariance) / per_unit;
    }
    reading.value[i] = value;
  }
  ticks_.advance();
  return true;
}

}  // namespace tagwrench::sim
