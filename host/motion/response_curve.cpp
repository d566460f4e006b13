#include "host/motion/response_curve.h"

#include <algorithm>
#include <cmath>

namespace tagwrench {
namespace {

/// Of full scale: where deflection begins is never quite nothing, which stands for rest.
constexpr double kNearest = 1e-12;

}  // namespace

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

namespace {

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

}  // namespace

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
    case CurveKind::linear:
      return x;
    case CurveKind::power:
      return std::pow(x, options_.power);
    case CurveKind::points:
      return between_points(x);
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

}  // namespace tagwrench
