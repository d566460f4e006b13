#include "host/motion/shaping.h"

#include <algorithm>
#include <cmath>

namespace tagwrench {
namespace {

constexpr Duration kMaxGap = std::chrono::milliseconds(500);  // then it begins anew
constexpr double kMaxNoise = 0.5;  // of full scale: a dead zone that noise makes
constexpr double kMaxPushed = 5;   // full scales: the largest swing that is waited for
constexpr double kNearRest = 2;    // dead zones; within, the noise is learnt

Vector6 limits(const ShapingOptions& options) {
  Vector6 limit;
  for (int i = 0; i < 6; ++i) limit[i] = options.axes[static_cast<std::size_t>(i)].limit;
  return limit;
}

}  // namespace

Shaping::Shaping(const ShapingOptions& options) noexcept
    : options_(options),
      filter_(options.filter, options.full_scale),
      swing_(options.swing),
      limit_(limits(options)) {
  for (std::size_t i = 0; i < curves_.size(); ++i)
    curves_[i] = ResponseCurve(options.axes[i].curve);
  if (options.lock == Lock::translation) limit_.head<3>().setZero();
  if (options.lock == Lock::rotation) limit_.tail<3>().setZero();
}

void Shaping::change(const ShapingOptions& options) noexcept {
  const MotionExtrapolator fill = fill_;
  *this = Shaping(options);
  fill_ = fill;
}

void Shaping::suppress(Sample& sample) noexcept {
  shape(sample);  // noise and swing go on
  sample.deflection.setZero();
  zones_ = {};
  strongest_ = -1;
  filter_.settle();
  fill_.reset();
}

void Shaping::begin_anew() noexcept {
  started_ = false;
  zones_ = {};
  swing_.reset();
  fill_.reset();
  strongest_ = -1;
}

Shaping::Order Shaping::order(TimePoint time) const noexcept {
  if (!started_ || time - last_ > kMaxGap || last_ - time > kMaxGap) return Order::first;
  return time > last_ ? Order::next : Order::stale;
}

/// The wrench as the device's axes take it, N and N m.
Vector6 Shaping::felt(const Vector6& wrench) const noexcept {
  Vector6 hid;
  hid << options_.hid_R_camera * wrench.head<3>(), options_.hid_R_camera * wrench.tail<3>();
  Vector6 felt;
  for (int i = 0; i < 6; ++i) {
    const AxisOptions& axis = options_.axes[static_cast<std::size_t>(i)];
    felt[i] = axis.invert ? -hid[axis.source] : hid[axis.source];
  }
  return felt;
}

Vector6 Shaping::felt_sigma(const Vector6& sigma) const noexcept {
  const Eigen::Matrix3d squares = options_.hid_R_camera.cwiseAbs2();
  Vector6 variance;
  variance << squares * sigma.head<3>().cwiseAbs2(), squares * sigma.tail<3>().cwiseAbs2();
  Vector6 felt;
  for (int i = 0; i < 6; ++i)
    felt[i] = std::sqrt(variance[options_.axes[static_cast<std::size_t>(i)].source]);
  return felt.cwiseMin(options_.full_scale);
}

/// N and N m: where rest ends.
Vector6 Shaping::rest_edge() const noexcept {
  const Vector6 noise = options_.noise_sigmas * noise_.sigma();
  return options_.dead_zone.cwiseMax(noise.cwiseMin(kMaxNoise * options_.full_scale));
}

void Shaping::shape(Sample& sample) noexcept {
  Vector6 raw = felt(sample.wrench);
  if (!carries_numbers(sample.status) || !raw.allFinite()) {
    sample.deflection.setZero();
    return begin_anew();
  }
  const Order place = order(sample.capture_time);
  if (place == Order::stale) {
    sample.deflection = fill_.newest();
    return;
  }
  const bool first = place == Order::first;
  if (first) begin_anew();
  const double seconds =
      first ? 0 : std::chrono::duration<double>(sample.capture_time - last_).count();
  started_ = true;
  last_ = sample.capture_time;
  const bool near_rest = (raw.cwiseAbs().array() <= kNearRest * rest_edge().array()).all();
  noise_.add(seconds, raw, felt_sigma(sample.wrench_sigma), near_rest);
  raw = meant(seconds, raw);
  if (first) {
    filter_.start(raw);
  } else {
    filter_.step(seconds, raw);
  }
  sample.deflection = deflection(raw);
  if (options_.dominant.on) keep_strongest(sample.deflection);
  fill_.add(sample.capture_time, sample.deflection);
}

/// Without the platform's swing, and within full scale: what is beyond would only have to be
/// forgotten again.
Vector6 Shaping::meant(double seconds, const Vector6& raw) noexcept {
  const Vector6 push =
      raw.cwiseQuotient(options_.full_scale).cwiseMin(kMaxPushed).cwiseMax(-kMaxPushed);
  swing_.add(seconds, push);
  Vector6 meant = raw.cwiseMin(options_.full_scale).cwiseMax(-options_.full_scale);
  for (int i = 0; i < 6; ++i) {
    if (std::abs(push[i]) <= swing_.size()) meant[i] = 0;
  }
  return meant;
}

Vector6 Shaping::deflection(const Vector6& raw) noexcept {
  const Vector6 edge = rest_edge();
  Vector6 motion = Vector6::Zero();
  for (int i = 0; i < 6; ++i) {
    DeadZone& zone = zones_[static_cast<std::size_t>(i)];
    const double part = zone.deflection(
        filter_.value()[i], raw[i], {edge[i], options_.release * edge[i], options_.full_scale[i]});
    // Released, but smoothing lags behind: or the next push, the other way, would begin with this.
    if (zone.resting() && std::abs(filter_.value()[i]) > edge[i]) filter_.settle(i);
    const double gain = i < 3 ? options_.translation : options_.rotation;
    const double size = gain * curves_[static_cast<std::size_t>(i)](std::abs(part));
    if (size > 0) motion[i] = std::copysign(std::min(size, limit_[i]), part);
  }
  return motion;
}

/// Zero for all others, so that none creeps in beside the one that is meant.
void Shaping::keep_strongest(Vector6& motion) noexcept {
  int strongest = 0;
  const double most = motion.cwiseAbs().maxCoeff(&strongest);
  const double kept = strongest_ < 0 ? 0 : std::abs(motion[strongest_]);
  if (kept == 0 || most > options_.dominant.ratio * kept) strongest_ = most > 0 ? strongest : -1;
  for (int i = 0; i < 6; ++i) {
    if (i != strongest_) motion[i] = 0;
  }
}

Vector6 Shaping::motion_at(TimePoint time) const noexcept {
  return options_.fill == Fill::predict ? fill_.at(time, limit_) : fill_.newest();
}

}  // namespace tagwrench
