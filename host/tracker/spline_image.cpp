#include "host/tracker/spline_image.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <utility>

namespace tagwrench {
namespace {

/// Of the quintic spline's prefilter (Unser, Aldroubi, Eden, "B-spline signal processing", IEEE TSP
/// 41(2), 1993).
constexpr std::array<double, 2> kPoles = {-0.430575347099973791851, -0.0430962882032646535};

/// Turns samples into spline coefficients, in place.
void prefilter(float* line, int count, std::ptrdiff_t step, std::vector<double>& work) {
  if (count < 2) return;
  constexpr int kHorizon = 24;  // |pole|^24 is below float's resolution
  work.resize(static_cast<std::size_t>(count));
  double gain = 1;
  for (const double pole : kPoles) gain *= (1 - pole) * (1 - 1 / pole);
  for (int i = 0; i < count; ++i) work[static_cast<std::size_t>(i)] = gain * line[i * step];
  const std::size_t last = work.size() - 1;
  for (const double pole : kPoles) {
    double first = 0;
    double power = 1;
    for (int i = 0; i < std::min(kHorizon, count); ++i, power *= pole)
      first += power * work[static_cast<std::size_t>(i)];
    work[0] = first;
    for (std::size_t i = 1; i <= last; ++i) work[i] += pole * work[i - 1];
    work[last] = pole / (pole * pole - 1) * (pole * work[last - 1] + work[last]);
    for (std::size_t i = last; i-- > 0;) work[i] = pole * (work[i + 1] - work[i]);
  }
  for (int i = 0; i < count; ++i)
    line[i * step] = static_cast<float>(work[static_cast<std::size_t>(i)]);
}

constexpr int kTaps = 6;

double quintic(double x) {
  const double a = std::abs(x);
  const double b = a * a;
  if (a < 1) return 11.0 / 20 + b * (-0.5 + b * (0.25 - a / 12));
  if (a < 2)
    return 17.0 / 40 + a * (5.0 / 8 + a * (-7.0 / 4 + a * (5.0 / 4 + a * (-3.0 / 8 + a / 24))));
  if (a < 3)
    return 81.0 / 40 + a * (-27.0 / 8 + a * (9.0 / 4 + a * (-3.0 / 4 + a * (1.0 / 8 - a / 120))));
  return 0;
}

/// Of the coefficients from two before to three after, `t` past the middle one.
std::array<double, kTaps> weights(double t) {
  std::array<double, kTaps> out;
  for (int i = 0; i < kTaps; ++i) out[static_cast<std::size_t>(i)] = quintic(t - (i - 2));
  return out;
}

constexpr int kGrid = 7;  // samples along a side of the pixel's area

using Fit = Eigen::Matrix<double, 10, kGrid * kGrid>;

double offset(int i) { return (i + 0.5) / kGrid - 0.5; }

Fit make_fit() {
  Eigen::Matrix<double, kGrid * kGrid, 10> basis;
  for (int j = 0; j < kGrid; ++j) {
    for (int i = 0; i < kGrid; ++i) {
      const double x = offset(i);
      const double y = offset(j);
      basis.row(j * kGrid + i) << 1, x, y, x * x, x * y, y * y, x * x * x, x * x * y, x * y * y,
          y * y * y;
    }
  }
  return (basis.transpose() * basis).ldlt().solve(basis.transpose());
}

}  // namespace

SplineImage::SplineImage(std::vector<float> levels, int left, int top, int width, int height)
    : coefficients_(std::move(levels)), left_(left), top_(top), width_(width), height_(height) {
  std::vector<double> work;
  for (int row = 0; row < height; ++row) {
    prefilter(coefficients_.data() + static_cast<std::ptrdiff_t>(row) * width, width, 1, work);
  }
  for (int column = 0; column < width; ++column) {
    prefilter(coefficients_.data() + column, height, width, work);
  }
}

double SplineImage::coefficient(int column, int row) const {
  column = std::clamp(column, 0, width_ - 1);
  row = std::clamp(row, 0, height_ - 1);
  return coefficients_[static_cast<std::size_t>(row) * static_cast<std::size_t>(width_) +
                       static_cast<std::size_t>(column)];
}

double SplineImage::level(double x, double y) const {
  x -= left_;
  y -= top_;
  const int column = static_cast<int>(std::floor(x));
  const int row = static_cast<int>(std::floor(y));
  const std::array<double, kTaps> wx = weights(x - column);
  const std::array<double, kTaps> wy = weights(y - row);
  double sum = 0;
  for (int j = 0; j < kTaps; ++j) {
    double line = 0;
    for (int i = 0; i < kTaps; ++i) {
      line += wx[static_cast<std::size_t>(i)] * coefficient(column + i - 2, row + j - 2);
    }
    sum += wy[static_cast<std::size_t>(j)] * line;
  }
  return sum;
}

PixelPolynomial SplineImage::polynomial(int x, int y) const {
  static const Fit fit = make_fit();
  Eigen::Matrix<double, kGrid * kGrid, 1> levels;
  for (int j = 0; j < kGrid; ++j) {
    for (int i = 0; i < kGrid; ++i) levels[j * kGrid + i] = level(x + offset(i), y + offset(j));
  }
  PixelPolynomial out;
  Eigen::Map<Eigen::Matrix<double, 10, 1>>(out.data()) = fit * levels;
  return out;
}

}  // namespace tagwrench
