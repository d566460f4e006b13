#include "host/source/simulator/bench_references.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "host/source/simulator/geometry.h"

namespace tagwrench::sim {
namespace {

constexpr double kFilterStep = 1e-3;             // s
constexpr double kStepVariance = 1.0 / 12;       // of whole counts, counts^2 (uniform)
constexpr double kMaxCounts = 32767;             // of a 16-bit reading
constexpr std::uint64_t kFirstTick = 1'000'000;  // numbers of the seeds' streams
constexpr std::uint64_t kScale = 1'000'001;
constexpr std::uint64_t kPlace = 1'000'002;

double first_tick(std::uint64_t seed, Stream stream, double rate) {
  return Random::numbered(seed, stream, kFirstTick).uniform() / rate;
}

double sign(const ReferenceFaults& faults) { return faults.wrong_sign ? -1 : 1; }

}  // namespace

ReferenceTicks::ReferenceTicks(double rate, double first, const ReferenceFaults& faults) noexcept
    : period_(1 / rate), first_(first), time_(first), faults_(faults) {}

double ReferenceTicks::stamp() const noexcept {
  return time_ * (1 + 1e-6 * faults_.clock_ppm) + faults_.clock_offset;
}

bool ReferenceTicks::silent() const noexcept {
  return time_ >= faults_.silent_from && time_ < faults_.silent_to;
}

SimulatedLoadCell::SimulatedLoadCell(const Bench& bench)
    : bench_(bench),
      settings_(bench.settings().load_cell),
      ticks_(settings_.rate, first_tick(bench.seed(), kLoadCell, settings_.rate), settings_.faults),
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
      ticks_(settings_.rate, first_tick(bench.seed(), kSixAxis, settings_.rate), settings_.faults),
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
