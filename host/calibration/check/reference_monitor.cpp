#include "host/calibration/check/reference_monitor.h"

#include <algorithm>
#include <cmath>

#include "host/wrench/zero.h"

namespace tagwrench {
namespace {

constexpr double kMaxGap = 1;   // s that one pair may stand for
constexpr double kMin = 20;     // independent pairs before a line is drawn
constexpr double kHuber = 2.5;  // standard deviations
constexpr double kNever = 1e300;

}  // namespace

/// West, "Updating mean and variance estimates", CACM 22(9), 1979.
void ReferenceMonitor::take(double weight, double force, double measured) noexcept {
  weight_ += weight;
  const double part = weight / weight_;
  const double df = force - mean_force_;
  const double dm = measured - mean_measured_;
  mean_force_ += part * df;
  mean_measured_ += part * dm;
  force_force_ += weight * (1 - part) * df * df;
  force_measured_ += weight * (1 - part) * df * dm;
  measured_measured_ += weight * (1 - part) * dm * dm;
}

void ReferenceMonitor::fit() noexcept {
  slope_sigma_ = zero_sigma_ = kNever;
  if (independent_ < kMin || !(force_force_ > 0)) return;
  slope_ = force_measured_ / force_force_;
  zero_ = mean_measured_ - slope_ * mean_force_;
  const double squares = std::max(0.0, measured_measured_ - slope_ * force_measured_);
  const double variance = squares / weight_;
  residual_ = std::sqrt(variance);
  const double spread = force_force_ / weight_;
  const double of_mean = variance / (independent_ - 2);
  slope_sigma_ = std::sqrt(of_mean / spread);
  zero_sigma_ = std::sqrt(of_mean * (1 + mean_force_ * mean_force_ / spread));
}

bool ReferenceMonitor::confirmed(Suspicion& suspicion, bool now, double dt) const noexcept {
  suspicion.lasted = now ? suspicion.lasted + dt : 0;
  if (suspicion.told || suspicion.lasted < options_.dwell) return false;
  return suspicion.told = true;
}

ReferenceFault ReferenceMonitor::add(TimePoint time, const Vector6& wrench, const Vector6& line,
                                     const Vector6& range, double force) noexcept {
  Vector6 u = Vector6::Zero(), m = Vector6::Zero();
  for (int i = 0; i < 6; ++i) {
    if (!(range[i] > 0 && range[i] < kUnknownRange)) continue;
    u[i] = line[i] / range[i];
    m[i] = wrench[i] / range[i];
  }
  const double along = u.squaredNorm();
  if (!(along > 0) || !std::isfinite(force) || !m.allFinite()) return ReferenceFault::none;
  range_ = 1 / u.cwiseAbs().maxCoeff();
  const double measured = u.dot(m) / along;
  const double since = started_ ? std::chrono::duration<double>(time - last_).count() : 0.0;
  const double dt = std::clamp(since, 0.0, kMaxGap);
  if (started_ && since <= 0) return ReferenceFault::none;
  started_ = true;
  last_ = time;
  if ((m - u * measured).cwiseAbs().maxCoeff() > options_.off_line) return ReferenceFault::none;

  const double kept = std::exp(-dt / options_.memory);
  weight_ *= kept;
  independent_ *= kept;
  force_force_ *= kept;
  force_measured_ *= kept;
  measured_measured_ *= kept;
  double weight = 1;
  if (slope_sigma_ < kNever && residual_ > 0) {
    const double off = std::abs(measured - zero_ - slope_ * force) / residual_;
    weight = std::min(1.0, kHuber / std::max(off, 1e-9));
  }
  take(weight, force, measured);
  independent_ += weight * std::min(1.0, dt / options_.correlation);
  fit();

  const double off = std::abs(slope_ - 1);
  const bool excited = std::sqrt(force_force_ / weight_) > options_.excitation * range_;
  const bool scale_off = excited && slope_sigma_ < options_.scale / options_.sigmas &&
                         off > options_.scale && off > options_.sigmas * slope_sigma_;
  const double zero_limit = options_.zero * range_;
  const bool zero_off = zero_sigma_ < zero_limit / options_.sigmas &&
                        std::abs(zero_) > zero_limit &&
                        std::abs(zero_) > options_.sigmas * zero_sigma_;
  if (confirmed(scale_fault_, scale_off, dt)) return ReferenceFault::scale;
  if (confirmed(zero_fault_, zero_off, dt)) return ReferenceFault::zero;
  return ReferenceFault::none;
}

}  // namespace tagwrench
