#include "host/motion/shaping.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "host/wrench/zero.h"

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

/// Of full scale: where deflection begins is never quite nothing, which stands for rest.
constexpr double kNearest = 1e-12;

/// The slope at a point between two intervals of widths h and slopes d. Zero where one of them is
/// flat, else their weighted harmonic mean, which Fritsch and Butland ("A method for constructing
/// local monotone piecewise cubic interpolants", SIAM J. Sci. Stat. Comput. 5(2), 1984) found to
/// lie inside Fritsch and Carlson's bounds.
double inner_slope(double h0, double d0, double h1, double d1) {
  if (d0 <= 0 || d1 <= 0) return 0;
  const double w0 = 2 * h1 + h0;
  const double w1 = h1 + 2 * h0;
  return (w0 + w1) / (w0 / d0 + w1 / d1);
}

/// The slope at an end, by the parabola through three points, kept within the bounds.
double end_slope(double h0, double d0, double h1, double d1) {
  const double slope = ((2 * h0 + h1) * d0 - h0 * d1) / (h0 + h1);
  return std::clamp(slope, 0.0, 3 * d0);
}

/// Of a low pass of first order, for a step of `seconds`.
double weight_of_cutoff(double cutoff_hz, double seconds) {
  return 1 / (1 + 1 / (2 * std::numbers::pi * cutoff_hz * seconds));
}

constexpr double kMemory = 2;             // s
constexpr double kUnequalSteps = 1.5;     // beyond this ratio second differences are no measure
constexpr double kSecondDifferences = 6;  // their variance, times that of one value: 1 + 4 + 1

constexpr double kOfLate = 0.06;  // s
constexpr double kLeft = 0.1;     // of a push: it is gone
constexpr double kMargin = 1.15;  // of its size: axes swing into each other
constexpr double kMin = 0.02;

constexpr double kFarthest = 1.5;     // frame periods
constexpr double kMaxOfMotion = 0.3;  // that it goes on by
constexpr double kCaution = 2.5;      // times the growth of deceleration

double seconds(Duration time) { return std::chrono::duration<double>(time).count(); }

/// How far motion goes on within `ahead` periods, in a period's worth of slope; from its slopes
/// over the last three intervals. Nothing, if they disagree about the direction. The slope is at
/// most that of the interval before, falls as fast as it does now and, if ever faster, faster
/// still; and when it is used up motion stays.
double carry(double now, double before, double long_before, double ahead) {
  if (now * before <= 0 || before * long_before <= 0) return 0;
  const double a = std::abs(now);
  const double b = std::abs(before);
  const double c = std::abs(long_before);
  const double growth = std::min(0.0, (a - b) - (b - c));
  const double change = std::min(0.0, a - b + kCaution * growth);
  const double slope = std::min(a + change / 2, b);
  if (slope <= 0) return 0;
  const double within = change < 0 ? std::min(ahead, -slope / change) : ahead;
  return std::copysign(slope * within + change * within * within / 2, now);
}

}  // namespace

Vector6 turned(const Eigen::Matrix3d& rotation, const Vector6& load) {
  Vector6 turned;
  turned << rotation * load.head<3>(), rotation * load.tail<3>();
  return turned;
}

Vector6 turned_sigma(const Eigen::Matrix3d& rotation, const Vector6& sigma) {
  return turned(rotation.cwiseAbs2(), sigma.cwiseAbs2()).cwiseSqrt();
}

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

Shaping::Order Shaping::order(TimePoint time) const noexcept {
  if (!started_ || time - last_ > kMaxGap || last_ - time > kMaxGap) return Order::first;
  return time > last_ ? Order::next : Order::stale;
}

/// The wrench as the device's axes take it, N and N m.
Vector6 Shaping::felt(const Vector6& wrench) const noexcept {
  const Vector6 hid = turned(options_.hid_R_camera, wrench);
  Vector6 felt;
  for (int i = 0; i < 6; ++i) {
    const AxisOptions& axis = options_.axes[static_cast<std::size_t>(i)];
    felt[i] = axis.invert ? -hid[axis.source] : hid[axis.source];
  }
  return felt;
}

Vector6 Shaping::felt_sigma(const Vector6& sigma) const noexcept {
  const Vector6 hid = turned_sigma(options_.hid_R_camera, sigma);
  Vector6 felt;
  for (int i = 0; i < 6; ++i) felt[i] = hid[options_.axes[static_cast<std::size_t>(i)].source];
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
  if (first)
    filter_.start(raw);
  else
    filter_.step(seconds, raw);
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
  for (int i = 0; i < 6; ++i)
    if (std::abs(push[i]) <= swing_.size()) meant[i] = 0;
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
  for (int i = 0; i < 6; ++i)
    if (i != strongest_) motion[i] = 0;
}

double DeadZone::deflection(double smooth, double raw, const Edges& edges) noexcept {
  const double push = std::abs(smooth);
  const double nearest = kNearest * edges.full_scale;
  const bool turned = std::signbit(smooth) != std::signbit(zero_);
  double zero = turned ? 0 : std::abs(zero_);
  if (zero == 0 && push > edges.outer) zero = std::max(edges.outer, nearest);
  if (push <= edges.inner || std::abs(raw) <= edges.inner) zero = 0;
  if (zero == 0) {
    zero_ = 0;
    return 0;
  }
  const double onward = std::max(0.0, push - edges.outer);
  if (onward > 0 && edges.outer > 0)
    zero = std::min(zero, edges.outer - (edges.outer - edges.inner) * onward / edges.outer);
  zero = std::max({zero, edges.inner, nearest});
  zero_ = std::copysign(zero, smooth);
  return std::copysign(std::clamp((push - zero) / (edges.full_scale - zero), 0.0, 1.0), smooth);
}

ResponseCurve::ResponseCurve(const CurveOptions& options) noexcept : options_(options) {
  if (options.kind != CurveKind::points) return;
  std::array<double, kMaxCurvePoints> width{};
  std::array<double, kMaxCurvePoints> rise{};
  const std::size_t intervals = options.count - 1;
  for (std::size_t i = 0; i < intervals; ++i) {
    width[i] = options.points[i + 1].in - options.points[i].in;
    rise[i] = (options.points[i + 1].out - options.points[i].out) / width[i];
  }
  slope_[0] = slope_[intervals] = rise[0];
  if (intervals == 1) return;
  for (std::size_t i = 1; i < intervals; ++i)
    slope_[i] = inner_slope(width[i - 1], rise[i - 1], width[i], rise[i]);
  slope_[0] = end_slope(width[0], rise[0], width[1], rise[1]);
  slope_[intervals] = end_slope(width[intervals - 1], rise[intervals - 1], width[intervals - 2],
                                rise[intervals - 2]);
}

double ResponseCurve::operator()(double in) const noexcept {
  const double x = std::clamp(in, 0.0, 1.0);
  switch (options_.kind) {
    case CurveKind::linear: return x;
    case CurveKind::power: return std::pow(x, options_.power);
    case CurveKind::points: return between_points(x);
  }
  return x;
}

/// Cubic Hermite interpolation.
double ResponseCurve::between_points(double in) const noexcept {
  std::size_t i = 0;
  while (i + 2 < options_.count && in > options_.points[i + 1].in) ++i;
  const CurvePoint& left = options_.points[i];
  const CurvePoint& right = options_.points[i + 1];
  const double width = right.in - left.in;
  const double t = (in - left.in) / width;
  const double u = 1 - t;
  return u * u * (1 + 2 * t) * left.out + t * t * (3 - 2 * t) * right.out +
         t * u * width * (u * slope_[i] - t * slope_[i + 1]);
}

ShapingOptions shaping_for(const Vector6& range, const Eigen::Matrix3d& hid_R_camera) {
  constexpr double kFullScale = 2.0 / 3;  // what is left is for the hand that pushes too hard
  ShapingOptions options;
  options.hid_R_camera = hid_R_camera;
  const Vector6 felt = range_along(hid_R_camera, range);
  for (int i = 0; i < 6; ++i) {
    if (felt[i] <= 0) continue;
    const double full_scale = kFullScale * felt[i];
    options.dead_zone[i] *= full_scale / options.full_scale[i];
    options.full_scale[i] = full_scale;
  }
  return options;
}

double AxisFilter::weight(double seconds, const Vector6& value) noexcept {
  switch (options_.kind) {
    case FilterKind::none: return 1;
    case FilterKind::exponential:
      return 1 - std::pow(1 - options_.weight, seconds * options_.weight_hz);
    case FilterKind::one_euro: {
      const Vector6 speed = (value - last_).cwiseQuotient(full_scale_) / seconds;
      speed_ += weight_of_cutoff(options_.speed_cutoff_hz, seconds) * (speed - speed_);
      const double fastest = speed_.cwiseAbs().maxCoeff();
      return weight_of_cutoff(options_.cutoff_hz + options_.hz_per_speed * fastest, seconds);
    }
  }
  return 1;
}

void NoiseFloor::add(double seconds, const Vector6& value, const Vector6& sigma,
                     bool rest) noexcept {
  const Vector6 variance = sigma.allFinite() ? sigma.cwiseAbs2().eval() : stated_;
  if (!any_) stated_ = variance;  // better than nothing, should somebody push already
  any_ = true;
  if (!rest) {
    known_ = 0;
  } else {
    const double weight = 1 - std::exp(-seconds / kMemory);
    stated_ += weight * (variance - stated_);
    learn_scatter(seconds, weight, value);
  }
  sigma_ = stated_.cwiseMax(scatter_).cwiseSqrt();
}

void NoiseFloor::learn_scatter(double seconds, double weight, const Vector6& value) noexcept {
  const double longer = std::max(seconds, last_step_);
  const double shorter = std::min(seconds, last_step_);
  if (known_ == 2 && longer <= kUnequalSteps * shorter) {
    const Vector6 second = value - 2 * values_[0] + values_[1];
    scatter_ += weight * (second.cwiseAbs2() / kSecondDifferences - scatter_);
  }
  values_ = {value, values_[0]};
  known_ = std::min(known_ + 1, 2);
  last_step_ = seconds;
}

void RingdownSuppressor::add(double seconds, const Vector6& push) noexcept {
  if (decay_ <= 0) return;
  size_ *= std::exp(-seconds / decay_);
  if (push.dot(push_) <= kLeft * push_.squaredNorm())
    size_ = std::max(size_, kMargin * push_.norm());
  if (size_ < kMin) size_ = 0;
  push_ *= std::exp(-seconds / kOfLate);
  if (push.squaredNorm() > push_.squaredNorm()) push_ = push;
}

void MotionExtrapolator::add(TimePoint time, const Vector6& motion) noexcept {
  if (frames_ > 0) {
    const double interval = seconds(time - time_);
    intervals_ = {interval, intervals_[0], intervals_[1]};
    slopes_ = {(motion - motion_) / interval, slopes_[0], slopes_[1]};
  }
  time_ = time;
  motion_ = motion;
  frames_ = std::min(frames_ + 1, 4);
}

Vector6 MotionExtrapolator::at(TimePoint time, const Vector6& limit) const noexcept {
  if (frames_ < 4 || time <= time_) return motion_;
  // The shortest interval: a lost frame does not make the period longer.
  const double period = *std::min_element(intervals_.begin(), intervals_.end());
  const double ahead = std::min(seconds(time - time_) / period, kFarthest);
  Vector6 carried;
  for (int i = 0; i < 6; ++i) {
    const double most = kMaxOfMotion * std::abs(motion_[i]);
    const double on = period * carry(slopes_[0][i], slopes_[1][i], slopes_[2][i], ahead);
    const double size = std::min(std::abs(motion_[i] + std::clamp(on, -most, most)), limit[i]);
    carried[i] = motion_[i] == 0 ? 0 : std::copysign(size, motion_[i]);
  }
  return carried;
}

}  // namespace tagwrench
